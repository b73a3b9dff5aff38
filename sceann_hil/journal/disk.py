"""A full disk pauses long computations instead of ending them."""

from __future__ import annotations

import errno
import sqlite3
import time
from collections.abc import Callable

from sceann_hil.errors import DiskFull

SECONDS_BETWEEN_ATTEMPTS = 10.0
"""How often a full disk is tried again."""


def when_there_is_room(
    write: Callable[[], None], tell: Callable[[], None], wait: Callable[[float], None] = time.sleep
) -> None:
    """Write something; while the disk is full, say so once and try again until it is not.

    Args:
        write: may be called several times; raises what SQLite or the operating system raise on a full disk.
        tell: called before the first wait.
        wait: how to wait for some seconds.
    """
    told = False
    while True:
        try:
            write()
            return
        except (DiskFull, sqlite3.OperationalError, OSError) as error:
            if not _is_disk_full(error):
                raise
        if not told:
            tell()
            told = True
        wait(SECONDS_BETWEEN_ATTEMPTS)


def _is_disk_full(error: Exception) -> bool:
    if isinstance(error, DiskFull):
        return True
    if isinstance(error, sqlite3.OperationalError):
        return error.sqlite_errorcode == sqlite3.SQLITE_FULL
    return isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT)

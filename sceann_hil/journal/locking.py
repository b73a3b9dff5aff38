"""Locks on whole files, and short texts in them. The part for Windows was never tried there.

A lock belongs to an open descriptor. The operating system lets go of it when the process ends, however it ends.
"""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path

from sceann_hil.errors import CannotWrite

_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL)
_TAKEN = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES, errno.EDEADLK)

if sys.platform == "win32":
    import msvcrt

    _FAR = 0x7FFFFFFE
    """Locked bytes cannot even be read there, so the byte that stands for the file lies behind everything in it."""
    _FLAGS = os.O_BINARY | os.O_NOINHERIT

    def _lock(descriptor: int, shared: bool) -> None:
        os.lseek(descriptor, _FAR, os.SEEK_SET)
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

    def _write(descriptor: int, data: bytes) -> None:
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, data)

else:
    import fcntl

    _FLAGS = os.O_CLOEXEC

    def _lock(descriptor: int, shared: bool) -> None:
        fcntl.flock(descriptor, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)

    def _write(descriptor: int, data: bytes) -> None:
        os.pwrite(descriptor, data, 0)


def open_small_file(path: Path) -> int:
    """A descriptor of a small file that is made if it is not there; not inherited by other programs."""
    return os.open(path, os.O_RDWR | os.O_CREAT | _FLAGS, 0o644)


def write_whole(descriptor: int, data: bytes) -> None:
    """Make this all that the file holds. While it is as long as before, there is no moment without it."""
    _write(descriptor, data)
    if os.fstat(descriptor).st_size != len(data):
        os.ftruncate(descriptor, len(data))


def try_lock(descriptor: int, path: Path, *, shared: bool = False) -> bool:
    """Whether the file is locked now; False if another descriptor has locked it.

    Args:
        descriptor: of the file.
        path: of the file, for messages.
        shared: others may share the lock. On Windows nobody can.

    Raises:
        CannotWrite: the file system has no locks.
    """
    try:
        _lock(descriptor, shared)
    except OSError as error:
        if error.errno in _NO_LOCKS:
            raise CannotWrite(
                f"{path.parent}: this file system has no locks ({error.strerror}), so nothing would keep a second "
                "process away.",
                "Choose a folder on a local disk.",
            ) from error
        if error.errno not in _TAKEN:
            raise
        return False
    return True

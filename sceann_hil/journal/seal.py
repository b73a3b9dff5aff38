"""How a run's last process left its journal: a small file beside it, by which a lost or cut write-ahead log is noticed.

SQLite takes a damaged end of its write-ahead log for the end, and a missing log for an empty one: what the log held is
gone without a word. So the number of the newest transaction also stands outside. A process that closes the journal in
good order adds the SHA-256 of the file: while it is the same, every byte is.
"""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from sceann_hil.journal.locking import open_small_file, write_whole


@dataclass(frozen=True, slots=True)
class Seal:
    """What stands in the file.

    Attributes:
        transactions: number of the newest transaction.
        sha256: of the database file when it was closed; None while somebody writes, and after a crash.
    """

    transactions: int
    sha256: str | None = None

    @classmethod
    def read(cls, database: Path) -> Self | None:
        """The seal of a database; None if it has none (an older version's, a copy), or one that nobody can read."""
        try:
            words = seal_path(database).read_text(encoding="ascii").split()
            return cls(int(words[0]), words[1] if len(words) > 1 else None)
        except (OSError, ValueError, IndexError):
            return None


class Sealer:
    """Keeps the seal of a database that is being written.

    Args:
        database: its file.
    """

    def __init__(self, database: Path) -> None:
        self._database = database
        self._descriptor: int | None = None

    def note(self, transactions: int) -> None:
        """A transaction is on disk. Told to the operating system, which keeps it when this process dies."""
        if self._descriptor is None:
            self._descriptor = open_small_file(seal_path(self._database))
        write_whole(self._descriptor, f"{transactions:<20}\n".encode())

    def close(self, transactions: int, *, whole: bool) -> None:
        """Nobody writes any more.

        Args:
            transactions: number of the newest one.
            whole: everything is in the database file, nothing in a log beside it.
        """
        self.note(transactions)
        if whole and self._descriptor is not None:
            write_whole(self._descriptor, f"{transactions:<20} {file_sha256(self._database)}\n".encode())
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None


def seal_path(database: Path) -> Path:
    """Where a database's seal is."""
    return database.with_name(f"{database.name}.seal")


def file_sha256(path: Path) -> str:
    """SHA-256 of a file, hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def is_untouched(path: Path) -> bool:
    """True while a database is byte for byte as the last process that wrote to it left it."""
    seal = Seal.read(path)
    if seal is None or seal.sha256 is None:
        return False
    log = path.with_name(f"{path.name}-wal")
    with suppress(OSError):
        return not (log.exists() and log.stat().st_size) and file_sha256(path) == seal.sha256
    return False

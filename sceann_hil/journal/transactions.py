"""Transactions that are counted, so that a lost one is noticed, on a file that is still where it was."""

from __future__ import annotations

import sqlite3
from contextlib import AbstractContextManager, nullcontext, suppress
from pathlib import Path
from types import TracebackType

from sceann_hil.errors import CannotWrite
from sceann_hil.journal.database import as_ours
from sceann_hil.journal.seal import Sealer


class Transactions:
    """A block of changes to a database: all of them at its end or, whatever was raised in it, none.

    Args:
        db: in autocommit mode, with a table ``head``.
        path: its file.
        sealer: told of every transaction.
        what: in a word, for messages.
    """

    def __init__(self, db: sqlite3.Connection, path: Path, sealer: Sealer, what: str = "journal") -> None:
        self._db = db
        self._path = path
        self._sealer = sealer
        self._what = what
        self._inode = path.stat().st_ino
        self._count = int(db.execute("SELECT transactions FROM head").fetchone()[0])
        self._mapping: AbstractContextManager[None] = nullcontext()
        self._closed = False
        with suppress(OSError):
            sealer.note(self._count)

    def __enter__(self) -> None:
        self._require_place()
        self._mapping = as_ours(self._path, self._what)
        self._mapping.__enter__()
        try:
            self._db.execute("BEGIN IMMEDIATE")
        except BaseException as error:
            self._mapping.__exit__(type(error), error, error.__traceback__)
            raise

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self._db.execute("UPDATE head SET transactions = ?", (self._count + 1,))
                self._db.execute("COMMIT")
        except BaseException as failure:
            self._undo()
            self._mapping.__exit__(type(failure), failure, failure.__traceback__)
            raise
        if kind is not None:
            self._undo()
            self._mapping.__exit__(kind, error, trace)
            return
        self._count += 1
        self._sealer.note(self._count)

    def close(self) -> None:
        """Fold the write-ahead log into the file, seal it, and let go of it. May be called twice."""
        if self._closed:
            return
        self._closed = True
        whole = False
        with suppress(sqlite3.Error):
            busy, log, _ = self._db.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
            whole = not busy and log <= 0
        with suppress(sqlite3.Error):
            self._db.close()
        with suppress(OSError):
            if self._path.exists() and self._path.stat().st_ino == self._inode:
                self._sealer.close(self._count, whole=whole)

    def _undo(self) -> None:
        with suppress(sqlite3.Error):
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")

    def _require_place(self) -> None:
        try:
            same = self._path.stat().st_ino == self._inode
        except OSError:
            same = False
        if not same:
            raise CannotWrite(
                f"{self._path} is not there any more: the run's folder was removed or renamed while the run went on.",
                "Nothing is evaluated that could not be recorded. Put the folder back, then `sceann resume` the run.",
            )

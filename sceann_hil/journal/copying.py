"""A sound copy of a run or a study, also while somebody works on it: the database as of one moment, log included.

A copy of the database file alone is none while a write-ahead log lies beside it.
"""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import suppress
from pathlib import Path

from sceann_hil.errors import RunExists
from sceann_hil.journal.database import as_ours
from sceann_hil.journal.seal import Sealer
from sceann_hil.places import make_folder


def copy_database(db: sqlite3.Connection, source: Path, target: Path) -> None:
    """The database behind an open connection as a new file, sealed.

    Args:
        db: open for reading.
        source: its file.
        target: where; its folder exists.
    """
    making = target.with_name(f".{target.name}.new")
    making.unlink(missing_ok=True)
    try:
        with as_ours(target):
            copy = sqlite3.connect(making, isolation_level=None)
            try:
                db.backup(copy)
                copy.execute("PRAGMA journal_mode = DELETE")
                tables = {row[0] for row in copy.execute("SELECT name FROM sqlite_schema")}
                row = copy.execute("SELECT transactions FROM head").fetchone() if "head" in tables else None
            finally:
                copy.close()
        making.replace(target)
    finally:
        making.unlink(missing_ok=True)
    if row is not None:
        Sealer(target).close(int(row[0]), whole=True)


def new_folder(place: Path) -> Path:
    """A folder that did not exist, or is empty.

    Raises:
        RunExists: there is something in it.
    """
    if place.exists() and (not place.is_dir() or any(place.iterdir())):
        raise RunExists(f"{place} exists already; nothing was overwritten.", "Choose another --out.")
    return make_folder(place)


def copy_beside(source: Path, target: Path, *names: str) -> None:
    """Small files for people that lie beside a database."""
    for name in names:
        with suppress(FileNotFoundError):
            shutil.copyfile(source / name, target / name)

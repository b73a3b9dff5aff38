"""Opening an SQLite file of ours, a run's journal or a study's results: the one place that does it.

Read-only files, folders and mounts can be read. A file that another program has locked is waited for, with a word about
who has it. Whatever SQLite complains about becomes an error of ours that names the file.
"""

from __future__ import annotations

import shutil
import sqlite3
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from sceann_hil.errors import NotARun, RunIsDamaged, RunIsNewer, database_error, way_out_of_damage
from sceann_hil.journal.lock import who_has_locked
from sceann_hil.journal.schema import statements
from sceann_hil.journal.seal import Seal

_MOST_PLAUSIBLE_SCHEMA = 100_000
_SECONDS_BEFORE_A_WORD = 2.0
_SECONDS_BETWEEN_LOOKS = 0.25
_BACKUP = "Restore it from a backup, or read on in docs/journal.md (Damage)."
_BUSY = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


@dataclass(frozen=True, slots=True)
class DatabaseKind:
    """A kind of database of ours.

    Attributes:
        what: in a word, for messages: journal, study.
        application_id: marks the file as ours.
        schema_version: the newest that is known.
        tables: that it has at least; their presence tells a damaged file from somebody else's.
        named_by: the command that prints the folder.
    """

    what: str
    application_id: int
    schema_version: int
    tables: tuple[str, ...]
    named_by: str


class Opened(NamedTuple):
    """A connection, and the schema that the file has."""

    connection: sqlite3.Connection
    schema_version: int


def open_database(kind: DatabaseKind, path: Path, *, write: bool, checked: bool = True) -> Opened:
    """A connection to a database of ours, after a look at whether it is one.

    Args:
        kind: what it has to be.
        path: of an existing file.
        write: the caller holds the `RunLock`.
        checked: compare it with its seal, so that a lost write-ahead log is noticed.

    Raises:
        NotARun: the file is something else.
        RunIsNewer: its schema is newer than this version's.
        RunIsDamaged: SQLite cannot read it, or a part of it is missing.
        CannotRead, CannotWrite: the operating system does not let us.
    """
    seal = Seal.read(path) if checked else None
    with as_ours(path, kind.what):
        db = _connect(path, write=write)
    try:
        with understood(path, kind.what):
            version = _identified(kind, db, path)
            if write:
                db.execute("PRAGMA journal_mode = WAL")
                db.execute("PRAGMA synchronous = FULL")
                db.execute("PRAGMA foreign_keys = ON")
            if version > 1 and seal is not None:
                _check_complete(db, seal, path)
    except BaseException:
        db.close()
        raise
    return Opened(db, version)


@contextmanager
def new_database(path: Path, schema: str, application_id: int, schema_version: int) -> Iterator[sqlite3.Connection]:
    """A database of ours that is being made, with all its tables, empty; whole when the block ends without an error.

    Args:
        path: where; nothing is there.
        schema: its statements.
        application_id: marks the file as ours.
        schema_version: of the statements.
    """
    db = sqlite3.connect(path, isolation_level=None)
    try:
        db.execute("BEGIN IMMEDIATE")
        make_tables(db, schema, application_id, schema_version)
        yield db
        db.execute("COMMIT")
    finally:
        db.close()


def make_tables(db: sqlite3.Connection, schema: str, application_id: int, schema_version: int) -> None:
    """All tables of a database of ours, empty, and what marks it as ours; see `new_database`."""
    for statement in statements(schema):
        db.execute(statement)
    db.execute(f"PRAGMA application_id = {application_id}")
    db.execute(f"PRAGMA user_version = {schema_version}")
    db.execute("INSERT INTO head VALUES (1, 0)")


@contextmanager
def migration(db: sqlite3.Connection) -> Iterator[None]:
    """Tables may be renamed and made anew in this block: all of it happens or, if anything stops that, nothing."""
    db.execute("PRAGMA foreign_keys = OFF")
    # what refers to a table goes on referring to its name, not to the table of old that is renamed
    db.execute("PRAGMA legacy_alter_table = ON")
    db.execute("BEGIN IMMEDIATE")
    try:
        yield
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise
    finally:
        db.execute("PRAGMA legacy_alter_table = OFF")
        db.execute("PRAGMA foreign_keys = ON")


@contextmanager
def as_ours(path: Path, what: str = "journal") -> Iterator[None]:
    """Errors of SQLite become errors of ours that name the file."""
    try:
        yield
    except sqlite3.IntegrityError:
        raise  # a rule of the tables would be broken: that is no damage
    except sqlite3.Error as error:
        raise database_error(error, path, what) from error
    except UnicodeDecodeError as error:
        # a name in a damaged file, or SQLite's words about it
        raise RunIsDamaged(f"{path} is damaged: {error}.", way_out_of_damage(path, what)) from error


@contextmanager
def understood(path: Path, what: str = "journal") -> Iterator[None]:
    """As `as_ours`, also for what was read and cannot be understood."""
    try:
        with as_ours(path, what):
            yield
    except (ValueError, KeyError, TypeError, IndexError, OverflowError) as error:
        # texts that are no UTF-8, JSON or hexadecimal, names of end reasons that do not exist
        raise RunIsDamaged(
            f"{path} is damaged: {type(error).__name__}: {error}.", way_out_of_damage(path, what)
        ) from error


def patiently(
    work: Callable[[], Any],
    path: Path,
    tell: Callable[[str], None] = _say,
    wait: Callable[[float], None] = time.sleep,
) -> Any:
    """Do something with a database; while another program has it locked, say so once and wait until it is free."""
    began_s, told = time.monotonic(), False
    while True:
        try:
            done = work()
        except sqlite3.OperationalError as error:
            if (error.sqlite_errorcode & 0xFF) not in _BUSY:
                raise
        else:
            if told:
                tell(f"{path} is free again; going on.")
            return done
        if not told and time.monotonic() - began_s > _SECONDS_BEFORE_A_WORD:
            tell(f"{path} is locked by {who_has_locked(path)}; waiting until it is free (Ctrl-C ends the waiting).")
            told = True
        wait(_SECONDS_BETWEEN_LOOKS)


class _Patient(sqlite3.Connection):
    """A connection that waits for other programs' locks when it begins something."""

    path: Path

    def execute(self, *args: Any) -> sqlite3.Cursor:
        if self.in_transaction:
            return super().execute(*args)
        return patiently(lambda: super(_Patient, self).execute(*args), self.path)  # type: ignore[no-any-return]


def _connect(path: Path, *, write: bool) -> sqlite3.Connection:
    address = path.absolute().as_uri()
    if write:
        _check_writable(path)
        return _Connection(f"{address}?mode=rw", path)
    try:
        db = _Connection(f"{address}?mode=ro", path)
        db.execute("SELECT count(*) FROM sqlite_schema").fetchone()
        return db
    except sqlite3.OperationalError as error:
        if (error.sqlite_errorcode & 0xFF) not in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_READONLY):
            raise
        if not _readable(path):
            raise
    # the folder is read-only: no files can be made beside the database, which SQLite wants for its log
    log = path.with_name(f"{path.name}-wal")
    if not log.exists() or log.stat().st_size == 0:
        return _Connection(f"{address}?mode=ro&immutable=1", path)
    with tempfile.TemporaryDirectory(prefix="sceann-") as folder:
        copy = Path(folder) / path.name
        shutil.copyfile(path, copy)
        shutil.copyfile(log, copy.with_name(log.name))
        whole = _Connection(f"{copy.as_uri()}?mode=rw", path)
        whole.execute("SELECT count(*) FROM sqlite_schema").fetchone()
        memory = _Connection(":memory:", path)
        whole.backup(memory)
        whole.close()
        return memory


def _Connection(address: str, path: Path) -> sqlite3.Connection:  # noqa: N802
    db = sqlite3.connect(
        address, uri=address != ":memory:", isolation_level=None, timeout=_SECONDS_BETWEEN_LOOKS, factory=_Patient
    )
    db.path = path
    return db


def _check_writable(path: Path) -> None:
    with suppress(FileNotFoundError):
        path.open("r+b").close()


def _readable(path: Path) -> bool:
    with suppress(OSError), path.open("rb") as file:
        return len(file.read(16)) == 16
    return False


def _identified(kind: DatabaseKind, db: sqlite3.Connection, path: Path) -> int:
    """The schema's version, if the file is what it has to be."""
    application = db.execute("PRAGMA application_id").fetchone()[0]
    version = int(db.execute("PRAGMA user_version").fetchone()[0])
    tables = {row[0] for row in db.execute("SELECT name FROM sqlite_schema WHERE type = 'table'").fetchall()}
    if application != kind.application_id and not tables.issuperset(kind.tables):
        raise NotARun(
            f"{path} is not a {kind.what} of this program.", f"Name the folder that `{kind.named_by}` printed."
        )
    if application != kind.application_id or not 0 < version <= _MOST_PLAUSIBLE_SCHEMA:
        raise RunIsDamaged(f"{path} is damaged: its first page is not as it was written.", _BACKUP)
    if version > kind.schema_version:
        raise RunIsNewer(
            f"{path.parent} was written by a newer version: its schema is {version}, this one knows up to "
            f"{kind.schema_version}.",
            "Update sceann-hil.",
        )
    if not tables.issuperset(kind.tables):
        missing = ", ".join(sorted(set(kind.tables) - tables))
        raise RunIsDamaged(f"{path} is damaged: it has no table {missing}.", _BACKUP)
    return version


def _check_complete(db: sqlite3.Connection, seal: Seal, path: Path) -> None:
    transactions = int(db.execute("SELECT transactions FROM head").fetchone()[0])
    if transactions < seal.transactions:
        raise RunIsDamaged(
            f"{path} is incomplete: its newest {seal.transactions - transactions} transactions are missing, because "
            f"the write-ahead log {path.name}-wal beside it is gone, cut off or damaged.",
            way_out_of_damage(path),
        )

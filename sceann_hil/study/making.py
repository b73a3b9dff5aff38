"""A study's database: made, or brought up from schema 1."""

from __future__ import annotations

import json
import sqlite3
from datetime import UTC, datetime
from pathlib import Path

from sceann_hil.journal.database import as_ours, make_tables, migration, new_database
from sceann_hil.journal.insertion import insert_row
from sceann_hil.journal.seal import seal_path
from sceann_hil.study.condition import Condition
from sceann_hil.study.config import Study
from sceann_hil.study.schema import APPLICATION_ID, AS_TODAY, SCHEMA, SCHEMA_VERSION, STUDY_NAME, columns_of
from sceann_hil.versions import running_versions


def create_study(study: Study, directory: Path) -> None:
    """Make a study's database; it gets its name when it is whole. The caller holds the lock."""
    path = directory / STUDY_NAME
    unfinished = path.with_suffix(".new")
    unfinished.unlink(missing_ok=True)
    seal_path(path).unlink(missing_ok=True)
    about = (study.config.name, study.config.about, now_text(), study.config.seed)
    with as_ours(path, "study"), new_database(unfinished, SCHEMA, APPLICATION_ID, SCHEMA_VERSION) as db:
        written = (json.dumps(study.written), json.dumps(running_versions()))
        insert_row(db, "study", (1, *about, *written), columns_of=columns_of)
        for c in study.conditions:
            row = (c.number, identity_text(c), json.dumps(c.settings), c.text)
            insert_row(db, "condition", row, columns_of=columns_of)
    unfinished.replace(path)


def read_as_today(db: sqlite3.Connection) -> None:
    """Let a connection see the tables of today in a study of schema 1, which stays as it is."""
    db.execute("PRAGMA temp_store = MEMORY")
    for table, question in AS_TODAY.items():
        db.execute(f"CREATE TEMP VIEW {table} AS SELECT *, NULL AS checksum FROM ({question.format('main.')})")


def bring_up_to_date(db: sqlite3.Connection) -> None:
    """Change a study of schema 1 into one of today's, all of it or, if anything stops that, nothing."""
    with migration(db):
        for table in AS_TODAY:
            db.execute(f"ALTER TABLE {table} RENAME TO old_{table}")
        make_tables(db, SCHEMA, APPLICATION_ID, SCHEMA_VERSION)
        for table, question in AS_TODAY.items():
            for row in db.execute(question.format("old_")).fetchall():
                insert_row(db, table, row, columns_of=columns_of)
        for table in reversed(AS_TODAY):
            db.execute(f"DROP TABLE old_{table}")


def identity_text(condition: Condition) -> str:
    """A condition's identity as it stands in the database."""
    return f"{condition.identity:016x}"


def now_text() -> str:
    """UTC, ISO 8601."""
    return datetime.now(UTC).isoformat(timespec="seconds")

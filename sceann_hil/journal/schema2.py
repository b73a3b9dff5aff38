"""Journals of schema 2: without the tables ``robot`` and ``batch``, which they get when they are opened for writing."""

from __future__ import annotations

import sqlite3

from sceann_hil.journal.schema import SCHEMA, SCHEMA_VERSION, columns_of, statements

_NEW = ("robot", "batch")


def read_as_today(db: sqlite3.Connection) -> None:
    """Let a connection see these tables, empty, in a journal that has none, which stays as it is."""
    db.execute("PRAGMA temp_store = MEMORY")
    for table in _NEW:
        nothing = ", ".join(f"NULL AS {name}" for name in (*columns_of(table), "checksum"))
        db.execute(f"CREATE TEMP VIEW {table} AS SELECT {nothing} WHERE 0")


def bring_up_to_date(db: sqlite3.Connection) -> None:
    """Change a journal of schema 2 into one of today's."""
    db.execute("BEGIN IMMEDIATE")
    try:
        for statement in statements(SCHEMA):
            if statement.split()[:3] in [["CREATE", "TABLE", table] for table in _NEW]:
                db.execute(statement)
        db.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise

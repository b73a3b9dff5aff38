"""Journals of schema 2: today's without the table ``batch``, which they get when they are opened for writing."""

from __future__ import annotations

import sqlite3

from sceann_hil.journal.schema import SCHEMA, SCHEMA_VERSION, columns_of, statements


def read_as_today(db: sqlite3.Connection) -> None:
    """Let a connection see an empty table ``batch`` in a journal that has none, which stays as it is."""
    nothing = ", ".join(f"NULL AS {name}" for name in (*columns_of("batch"), "checksum"))
    db.execute("PRAGMA temp_store = MEMORY")
    db.execute(f"CREATE TEMP VIEW batch AS SELECT {nothing} WHERE 0")


def bring_up_to_date(db: sqlite3.Connection) -> None:
    """Change a journal of schema 2 into one of today's."""
    (statement,) = (text for text in statements(SCHEMA) if "CREATE TABLE batch" in text)
    db.execute("BEGIN IMMEDIATE")
    try:
        db.execute(statement)
        db.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise

"""Journals of schema 1: read as they are, and brought up to date when they are opened for writing.

In schema 1 runs of the reference genome had a table of their own; they become attempts after all others.
"""

from __future__ import annotations

import sqlite3

from sceann_hil.journal.schema import SCHEMA, SCHEMA_VERSION, statements

_AS_TODAY = {
    "run": "SELECT only_row, name, created_at, root_seed, config, versions, parent_run FROM {0}run",
    "generation": "SELECT number, algorithm_state, started_at, finished_at, wall_s, robot_s, best_fitness, "
    "mean_fitness, worst_fitness, success_rate FROM {0}generation",
    "individual": "SELECT id, generation, number, genome, parent, structure, fitness FROM {0}individual",
    "session": "SELECT id, started_at, robot, operators, limits, wall_s, paused_s, "
    "(SELECT versions FROM {0}run) AS versions, NULL AS body FROM {0}session",
    "measurement": "SELECT NULL AS id, NULL AS kind, NULL AS begun_at, NULL AS finished_at, NULL AS robot, "
    "NULL AS config, NULL AS plan FROM {0}run WHERE 0",
    "attempt": "SELECT id, 'evolution' AS kind, NULL AS session, NULL AS measurement, generation, individual, trial, "
    "attempt, NULL AS own_genome, start, noise_key, intent_at, ended_at, end_reason, steps, NULL AS value, state_hash, "
    "final_state, robot_s, fitness, operator_s, battery, note FROM {0}attempt "
    "UNION ALL SELECT (SELECT coalesce(max(id), 0) FROM {0}attempt) + id, 'reference', NULL, NULL, NULL, id - 1, "
    "trial, 0, genome, '[]', '', at, at, end_reason, steps, NULL, NULL, NULL, robot_s, fitness, NULL, NULL, NULL "
    "FROM {0}reference",
    "trace": "SELECT attempt, format, data FROM {0}trace",
    "event": "SELECT id, at, generation, kind, message FROM {0}event",
}
"""Each of today's tables as a question to those of schema 1, whose names begin with {0}; referred-to tables first."""
_OLD = (*(name for name in _AS_TODAY if name != "measurement"), "reference")


def read_as_today(db: sqlite3.Connection) -> None:
    """Let a connection see the tables of today in a journal of schema 1, which stays as it is."""
    db.execute("PRAGMA temp_store = MEMORY")
    for table, question in _AS_TODAY.items():
        db.execute(f"CREATE TEMP VIEW {table} AS {question.format('main.')}")


def bring_up_to_date(db: sqlite3.Connection) -> None:
    """Change a journal of schema 1 into one of today's, all of it or, if anything stops that, nothing."""
    db.execute("PRAGMA foreign_keys = OFF")
    # what refers to a table goes on referring to its name, not to the table of old that is renamed
    db.execute("PRAGMA legacy_alter_table = ON")
    db.execute("BEGIN IMMEDIATE")
    try:
        for index in db.execute("SELECT name FROM sqlite_schema WHERE type = 'index' AND sql IS NOT NULL").fetchall():
            db.execute(f"DROP INDEX {index[0]}")
        for table in _OLD:
            db.execute(f"ALTER TABLE {table} RENAME TO old_{table}")
        for statement in statements(SCHEMA):
            db.execute(statement)
        for table, question in _AS_TODAY.items():
            db.execute(f"INSERT INTO {table} {question.format('old_')}")
        for table in reversed(_OLD):
            db.execute(f"DROP TABLE old_{table}")
        db.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            db.execute("ROLLBACK")
        raise
    finally:
        db.execute("PRAGMA legacy_alter_table = OFF")
        db.execute("PRAGMA foreign_keys = ON")

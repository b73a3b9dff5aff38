"""Journals of schema 1: read as they are, and brought up to date when they are opened for writing.

In schema 1 runs of the reference genome had a table of their own; they become attempts after all others. Parents in
another run stood beside parents in this one. There were no checksums: they are made of what is there.
"""

from __future__ import annotations

import sqlite3
import zlib

from sceann_hil.journal.database import migration
from sceann_hil.journal.insertion import rewrite_digests, update_checksums
from sceann_hil.journal.schema import COLUMNS, SCHEMA, SCHEMA_VERSION, columns_of, statements

_MS = "CAST(round((julianday({}) - 2440587.5) * 86400000) AS INTEGER)"
_TOTAL = (
    "CASE WHEN s.id = (SELECT max(id) FROM {{0}}session) THEN (SELECT {0} FROM {{0}}attempt) "
    "+ (SELECT {1} FROM {{0}}reference) ELSE {2} END"
)
_OWN = "(SELECT {} FROM {{0}}attempt a WHERE a.generation = g.number AND g.finished_at IS NOT NULL)"
_OF_REFERENCE = (
    "(SELECT coalesce(max(id), 0) FROM {0}attempt) + id, 'reference', NULL, NULL, NULL, id - 1, trial, 0, genome, "
    f"'[]', 0, {_MS.format('at')}, {_MS.format('at')}, end_reason, steps, NULL, NULL, NULL, robot_s, fitness, "
    "NULL, NULL, NULL"
)

_AS_TODAY = {
    "run": "SELECT only_row, name, created_at, root_seed, config, versions, parent_run FROM {0}run",
    "generation": "SELECT number, started_at, NULL AS state_checksum, NULL AS begun_digest, finished_at, wall_s, "
    f"{_OWN.format('nullif(count(end_reason), 0)')} AS attempts, robot_s, "
    f"{_OWN.format('sum(coalesce(operator_s, 0.0))')} AS operator_s, best_fitness, mean_fitness, worst_fitness, "
    f"success_rate, {_OWN.format('max(id)')} AS last_attempt, NULL AS digest, algorithm_state FROM {{0}}generation g",
    "individual": "SELECT id, generation, number, genome, iif(generation = 0, NULL, parent) AS parent, "
    "iif(generation = 0, parent, NULL) AS ancestor, structure, fitness FROM {0}individual",
    "session": "SELECT id, started_at, robot, operators, limits, wall_s, paused_s, "
    f"{_TOTAL.format('count(*)', 'count(*)', 0)} AS attempts, "
    f"{_TOTAL.format('count(end_reason)', 'count(*)', 0)} AS ended, "
    f"{_TOTAL.format('coalesce(sum(robot_s), 0.0)', 'coalesce(sum(robot_s), 0.0)', 0.0)} AS robot_s, "
    f"{_TOTAL.format('coalesce(sum(operator_s), 0.0)', '0.0', 0.0)} AS operator_s, "
    "(SELECT versions FROM {0}run) AS versions, NULL AS body FROM {0}session s",
    "measurement": "SELECT NULL AS id, NULL AS kind, NULL AS begun_at, NULL AS finished_at, NULL AS robot, "
    "NULL AS config, NULL AS plan FROM {0}run WHERE 0",
    "attempt": "SELECT id, 'evolution' AS kind, NULL AS session, NULL AS measurement, generation, individual, trial, "
    "attempt, NULL AS own_genome, start, from_hex(noise_key) AS noise_key, "
    f"{_MS.format('intent_at')} AS intent_at, {_MS.format('ended_at')} AS ended_at, end_reason, steps, NULL AS value, "
    "state_hash, final_state, robot_s, fitness, operator_s, battery, note FROM {0}attempt "
    f"UNION ALL SELECT {_OF_REFERENCE} FROM {{0}}reference",
    "trace": "SELECT attempt, format, data FROM {0}trace",
    "event": "SELECT id, at, generation, kind, message FROM {0}event",
}
"""Each of today's tables as a question to those of schema 1, whose names begin with {0}; referred-to tables first."""
_OLD = (*(name for name in _AS_TODAY if name != "measurement"), "reference")


def read_as_today(db: sqlite3.Connection) -> None:
    """Let a connection see the tables of today in a journal of schema 1, which stays as it is."""
    db.create_function("from_hex", 1, _from_hex, deterministic=True)
    db.execute("PRAGMA temp_store = MEMORY")
    for table, question in _AS_TODAY.items():
        db.execute(f"CREATE TEMP VIEW {table} AS SELECT *, NULL AS checksum FROM ({question.format('main.')})")
    # an attempt of schema 1 has its start values itself
    db.execute("CREATE TEMP VIEW start AS SELECT NULL AS id, NULL AS start_values, NULL AS checksum WHERE 0")


def bring_up_to_date(db: sqlite3.Connection) -> None:
    """Change a journal of schema 1 into one of today's, all of it or, if anything stops that, nothing."""
    db.create_function("from_hex", 1, _from_hex, deterministic=True)
    with migration(db):
        _change(db)


def _change(db: sqlite3.Connection) -> None:
    for (index,) in db.execute("SELECT name FROM sqlite_schema WHERE type = 'index' AND sql IS NOT NULL").fetchall():
        db.execute(f"DROP INDEX {index}")
    for table in _OLD:
        db.execute(f"ALTER TABLE {table} RENAME TO old_{table}")
    # the old tables' own index is what the questions find a generation's attempts by
    for statement in statements(SCHEMA):
        db.execute(statement)
    db.execute("INSERT INTO head VALUES (1, 0)")
    db.execute(
        "INSERT INTO start (start_values) SELECT DISTINCT start FROM old_attempt UNION SELECT '[]' FROM old_reference"
    )
    for table, question in _AS_TODAY.items():
        columns = [*columns_of(table), *(["algorithm_state"] if table == "generation" else [])]
        taken = [
            "(SELECT start.id FROM start WHERE start_values = old.start)"
            if (table, name) == ("attempt", "start")
            else name
            for name in columns
        ]
        old = question.format("old_")
        db.execute(f"INSERT INTO {table} ({', '.join(columns)}) SELECT {', '.join(taken)} FROM ({old}) AS old")
    for table in reversed(_OLD):
        db.execute(f"DROP TABLE old_{table}")
    db.create_function("crc32", 1, zlib.crc32, deterministic=True)
    db.execute("UPDATE generation SET state_checksum = crc32(algorithm_state)")
    for table in COLUMNS:
        update_checksums(db, table)
    rewrite_digests(db, since_generation=0)
    db.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")


def _from_hex(text: str | None) -> int | None:
    """64 bits in hexadecimal as the signed integer that SQLite has."""
    if not text:
        return 0
    number = int(text, 16)
    return number - 2**64 if number >= 2**63 else number

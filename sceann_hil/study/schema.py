"""What a study's database holds. ``docs/study.md`` explains the tables.

The version stands in SQLite's ``user_version``; ``application_id`` marks the file as ours. A change of any table is a
new version. Every row carries a checksum over its other columns (`sceann_hil.journal.checksums`).
"""

from __future__ import annotations

STUDY_NAME = "study.sqlite"
SCHEMA_VERSION = 2
APPLICATION_ID = 0x5CEA2211
"""Marks an SQLite file as a study of ours."""

SCHEMA = """
CREATE TABLE study (
    only_row   INTEGER PRIMARY KEY CHECK (only_row = 1),
    name       TEXT NOT NULL,
    about      TEXT NOT NULL,
    created_at TEXT NOT NULL,     -- UTC, ISO 8601
    seed       INTEGER NOT NULL,  -- root of the seed tree of all runs
    written    TEXT NOT NULL,     -- JSON: seed, base and grid as the user wrote them
    versions   TEXT NOT NULL,     -- JSON: this package, Python, NumPy, Numba, plug-ins, processor, machine
    checksum   INTEGER            -- of the columns before; so in every table
) STRICT;

CREATE TABLE head (
    only_row     INTEGER PRIMARY KEY CHECK (only_row = 1),
    transactions INTEGER NOT NULL -- that have changed this database so far
) STRICT;

CREATE TABLE condition (
    number   INTEGER PRIMARY KEY, -- place in the grid, from 0
    identity TEXT NOT NULL UNIQUE,-- 64 bits of the experiment's hash, hexadecimal
    settings TEXT NOT NULL,       -- JSON: [[axis, value], ...]
    config   TEXT NOT NULL,       -- the experiment, YAML with every default spelled out; its seed is not used
    checksum INTEGER
) STRICT;

CREATE TABLE session (
    id         INTEGER PRIMARY KEY,
    started_at TEXT NOT NULL,     -- UTC, ISO 8601
    workers    TEXT NOT NULL,     -- who computed
    wall_s     REAL NOT NULL,     -- from its beginning to its last result
    runs       INTEGER NOT NULL,  -- runs that it added
    versions   TEXT NOT NULL,     -- JSON: as in study, of this session
    checksum   INTEGER
) STRICT;

CREATE TABLE run (
    condition INTEGER NOT NULL REFERENCES condition (number),
    number    INTEGER NOT NULL,   -- from 0
    session   INTEGER REFERENCES session (id), -- that added it; NULL in studies begun by schema 1
    seed      INTEGER NOT NULL,   -- root seed: an experiment with it gives the same numbers
    fitness   REAL NOT NULL,      -- of the champion, the best individual of the last generation
    successes INTEGER NOT NULL,   -- the champion's trials that reached what the task asks for
    genome    TEXT NOT NULL,      -- the champion's bits, hexadecimal, first bit first
    best      BLOB NOT NULL,      -- best fitness of every generation, little-endian float32
    checksum  INTEGER,
    PRIMARY KEY (condition, number)
) STRICT, WITHOUT ROWID;
"""

COLUMNS = {
    "study": "only_row name about created_at seed written versions",
    "condition": "number identity settings config",
    "session": "id started_at workers wall_s runs versions",
    "run": "condition number session seed fitness successes genome best",
}
"""The columns that a row's checksum is made of, in order; tables that others refer to come first."""

AS_TODAY = {
    "study": "SELECT * FROM {0}study",
    "condition": "SELECT * FROM {0}condition",
    "session": "SELECT id, started_at, workers, wall_s, runs, (SELECT versions FROM {0}study) AS versions "
    "FROM {0}session",
    "run": "SELECT condition, number, NULL AS session, seed, fitness, successes, genome, best FROM {0}run",
}
"""Each table as a question to those of schema 1, whose names begin with {0}."""


def columns_of(table: str) -> list[str]:
    """Names of the columns that a row's checksum is made of."""
    return COLUMNS[table].split()

"""What a study's database holds. ``docs/study.md`` explains the tables.

The version stands in SQLite's ``user_version``; ``application_id`` marks the file as ours. A change of any table is a
new version.
"""

from __future__ import annotations

STUDY_NAME = "study.sqlite"
SCHEMA_VERSION = 1
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
    versions   TEXT NOT NULL      -- JSON: this package, Python, NumPy, Numba, machine
) STRICT;

CREATE TABLE condition (
    number   INTEGER PRIMARY KEY, -- place in the grid, from 0
    identity TEXT NOT NULL UNIQUE,-- 64 bits of the experiment's hash, hexadecimal
    settings TEXT NOT NULL,       -- JSON: [[axis, value], ...]
    config   TEXT NOT NULL        -- the experiment, YAML with every default spelled out; its seed is not used
) STRICT;

CREATE TABLE run (
    condition INTEGER NOT NULL REFERENCES condition (number),
    number    INTEGER NOT NULL,   -- from 0
    seed      INTEGER NOT NULL,   -- root seed: an experiment with it gives the same numbers
    fitness   REAL NOT NULL,      -- of the champion, the best individual of the last generation
    successes INTEGER NOT NULL,   -- the champion's trials that reached what the task asks for
    genome    TEXT NOT NULL,      -- the champion's bits, hexadecimal, first bit first
    best      BLOB NOT NULL,      -- best fitness of every generation, little-endian float32
    PRIMARY KEY (condition, number)
) STRICT, WITHOUT ROWID;

CREATE TABLE session (
    id         INTEGER PRIMARY KEY,
    started_at TEXT NOT NULL,     -- UTC, ISO 8601
    workers    TEXT NOT NULL,     -- who computed
    wall_s     REAL NOT NULL,     -- from its beginning to its last result
    runs       INTEGER NOT NULL   -- runs that it added
) STRICT;
"""

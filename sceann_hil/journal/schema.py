"""What a journal holds. ``docs/journal.md`` explains the tables with example questions.

The version stands in SQLite's ``user_version``; ``application_id`` marks the file as ours. A change of any table is a
new version. Written with write-ahead logging and full synchronisation: a committed row survives the loss of power.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator

JOURNAL_NAME = "journal.sqlite"
UNBORN_NAME = f".{JOURNAL_NAME}.new"
"""A journal that is being made; it gets its own name when it is whole."""
SCHEMA_VERSION = 2
APPLICATION_ID = 0x5CEA2210
"""Marks an SQLite file as a journal of ours."""

SCHEMA = """
CREATE TABLE run (
    only_row      INTEGER PRIMARY KEY CHECK (only_row = 1),
    name          TEXT NOT NULL,     -- of the experiment
    created_at    TEXT NOT NULL,     -- UTC, ISO 8601
    root_seed     INTEGER NOT NULL,  -- of the seed tree
    config        TEXT NOT NULL,     -- YAML with every default spelled out
    versions      TEXT NOT NULL,     -- JSON: this package, Python, NumPy, Numba, machine
    parent_run    TEXT               -- directory of the run whose population this one started from
) STRICT;

CREATE TABLE generation (
    number          INTEGER PRIMARY KEY,
    algorithm_state BLOB NOT NULL,   -- all the algorithm needs to go on from this population
    started_at      TEXT NOT NULL,
    finished_at     TEXT,            -- NULL while it is being evaluated
    wall_s          REAL,            -- time spent on its trials, without down-time
    robot_s         REAL,            -- sum of its trials' robot time
    best_fitness    REAL,
    mean_fitness    REAL,
    worst_fitness   REAL,
    success_rate    REAL             -- part of its trials that reached what the task asks for
) STRICT;

CREATE TABLE individual (
    id         INTEGER PRIMARY KEY,  -- over the whole run, in the order of birth
    generation INTEGER NOT NULL REFERENCES generation (number),
    number     INTEGER NOT NULL,     -- place in its generation, from 0
    genome     TEXT NOT NULL,        -- bits as hexadecimal, first bit first
    parent     INTEGER,              -- id of its parent (in parent_run for generation 0, if there is one)
    structure  TEXT,                 -- what the algorithm keeps besides the bits, as JSON (OGA: operons)
    fitness    REAL,                 -- NULL until all its trials are counted
    UNIQUE (generation, number)
) STRICT;

CREATE TABLE session (
    id         INTEGER PRIMARY KEY,
    started_at TEXT NOT NULL,        -- a process began to work on the run
    robot      TEXT NOT NULL,        -- name of the robot
    operators  TEXT NOT NULL,        -- who stood beside it
    limits     TEXT NOT NULL,        -- JSON: budgets over all sessions, in force during this one
    wall_s     REAL NOT NULL,        -- how long, up to the newest result
    paused_s   REAL NOT NULL,        -- of that, in pauses
    versions   TEXT NOT NULL,        -- JSON: this package, Python, NumPy, Numba, plug-ins, processor, machine
    body       TEXT                  -- fingerprint of the simulated body's code; NULL where there is none
) STRICT;

CREATE TABLE measurement (
    id          INTEGER PRIMARY KEY,
    kind        TEXT NOT NULL,       -- what for, in a word: compare, repeat, ...
    begun_at    TEXT NOT NULL,
    finished_at TEXT,                -- NULL: interrupted; the same plan goes on with it
    robot       TEXT NOT NULL,       -- name of the robot
    config      TEXT NOT NULL,       -- YAML: the configuration that it is made with
    plan        TEXT NOT NULL        -- JSON: what was asked for
) STRICT;

CREATE TABLE attempt (
    id          INTEGER PRIMARY KEY, -- the trial number that users, recordings and robots see
    kind        TEXT NOT NULL,       -- evolution, reference, measurement
    session     INTEGER REFERENCES session (id), -- in which it was begun; NULL in journals begun by schema 1
    measurement INTEGER REFERENCES measurement (id), -- which it belongs to; NULL of other kinds
    generation  INTEGER REFERENCES generation (number), -- NULL unless it is part of evolution
    individual  INTEGER NOT NULL,    -- place in its generation; of other kinds, which repetition of its genome, from 0
    trial       INTEGER NOT NULL,    -- which of the individual's trials, from 0
    attempt     INTEGER NOT NULL,    -- 0, and one more each time the attempt before was void
    own_genome  TEXT,                -- of other kinds than evolution: bits as hexadecimal
    start       TEXT NOT NULL,       -- JSON list in the order of the robot's start fields
    noise_key   TEXT NOT NULL,       -- 64 bits, hexadecimal
    intent_at   TEXT NOT NULL,       -- written before the trial starts
    ended_at    TEXT,                -- NULL: started, outcome not known
    end_reason  TEXT,
    steps       INTEGER,
    value       REAL,                -- what the task added up over the trial's steps; NULL if it adds up nothing
    state_hash  INTEGER,             -- CRC-16 of all neuron states
    final_state TEXT,                -- JSON list in the order of the robot's state fields
    robot_s     REAL,
    fitness     REAL,                -- NULL for a void attempt: a failed trial is never a number
    operator_s  REAL,                -- time that a person needed before and after it; NULL if nobody was asked
    battery     REAL,                -- what the robot measured after it, as a fraction of a full one
    note        TEXT,                -- words of an operator, or why it is void
    UNIQUE (generation, individual, trial, attempt)
) STRICT;

CREATE UNIQUE INDEX one_counted_result ON attempt (generation, individual, trial) WHERE fitness IS NOT NULL;
CREATE UNIQUE INDEX one_measured_result ON attempt (measurement, own_genome, individual, trial)
    WHERE fitness IS NOT NULL AND measurement IS NOT NULL;
CREATE INDEX attempt_of_another_kind ON attempt (kind, id) WHERE kind <> 'evolution';
CREATE INDEX attempt_by_fitness ON attempt (fitness);
CREATE INDEX individual_by_fitness ON individual (fitness);
CREATE INDEX individual_by_genome ON individual (genome);

CREATE TABLE trace (
    attempt INTEGER PRIMARY KEY REFERENCES attempt (id),
    format  TEXT NOT NULL,           -- how to read data
    data    BLOB NOT NULL            -- what a robot sent that could not be computed again
) STRICT;

CREATE TABLE event (
    id         INTEGER PRIMARY KEY,
    at         TEXT NOT NULL,
    generation INTEGER,
    kind       TEXT NOT NULL,        -- started, resumed, stopped, finished, operator, suspended, ...
    message    TEXT NOT NULL
) STRICT;
"""


def statements(schema: str) -> Iterator[str]:
    """The statements of a schema, one after the other: SQLite's own way of running many of them would commit."""
    statement = ""
    for line in schema.splitlines(keepends=True):
        statement += line
        if sqlite3.complete_statement(statement):
            yield statement
            statement = ""

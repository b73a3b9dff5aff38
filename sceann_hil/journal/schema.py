"""What a journal holds. ``docs/journal.md`` explains the tables with example questions.

The version stands in SQLite's ``user_version``; ``application_id`` marks the file as ours. A change of any table is a
new version. Written with write-ahead logging and full synchronisation: a committed row survives the loss of power.
Every row carries a checksum over its other columns (`sceann_hil.journal.checksums`).
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator

JOURNAL_NAME = "journal.sqlite"
UNBORN_NAME = f".{JOURNAL_NAME}.new"
"""A journal that is being made; it gets its own name when it is whole."""
SCHEMA_VERSION = 3
FIRST_WITH_CHECKSUMS = 2
"""Schema 2 is today's without the tables ``robot`` and ``batch``."""
APPLICATION_ID = 0x5CEA2210
"""Marks an SQLite file as a journal of ours."""

SCHEMA = """
CREATE TABLE run (
    only_row      INTEGER PRIMARY KEY CHECK (only_row = 1),
    name          TEXT NOT NULL,     -- of the experiment
    created_at    TEXT NOT NULL,     -- UTC, ISO 8601
    root_seed     INTEGER NOT NULL,  -- of the seed tree
    config        TEXT NOT NULL,     -- YAML with every default spelled out
    versions      TEXT NOT NULL,     -- JSON: this package, Python, NumPy, Numba, plug-ins, processor, machine
    parent_run    TEXT,              -- directory of the run whose population this one started from
    checksum      INTEGER            -- of the columns before; so in every table
) STRICT;

CREATE TABLE robot (
    only_row      INTEGER PRIMARY KEY CHECK (only_row = 1),
    spec          TEXT NOT NULL,     -- JSON: numbers of sensors and motors, tick, names of fields; for whoever has not
    checksum      INTEGER            -- the package that knows this robot. Empty in journals begun by schemas 1 and 2
) STRICT;

CREATE TABLE head (
    only_row      INTEGER PRIMARY KEY CHECK (only_row = 1),
    transactions  INTEGER NOT NULL   -- that have changed this journal so far
) STRICT;

CREATE TABLE generation (
    number          INTEGER PRIMARY KEY,
    started_at      TEXT NOT NULL,
    state_checksum  INTEGER,         -- CRC-32 of algorithm_state
    begun_digest    TEXT,            -- SHA-256 of the digest before, and of what this generation begins with
    finished_at     TEXT,            -- NULL while it is being evaluated, as is everything below
    wall_s          REAL,            -- time spent on its trials, without down-time
    attempts        INTEGER,         -- that ended
    robot_s         REAL,            -- sum of its trials' robot time
    operator_s      REAL,            -- sum of the time that a person needed
    best_fitness    REAL,
    mean_fitness    REAL,
    worst_fitness   REAL,
    success_rate    REAL,            -- part of its trials that reached what the task asks for
    last_attempt    INTEGER,         -- the newest attempt when it was finished: what came after the one before is its
    digest          TEXT,            -- SHA-256 of begun_digest, figures, individuals and attempts of all kinds
    checksum        INTEGER,
    algorithm_state BLOB NOT NULL    -- all the algorithm needs to go on from this population
) STRICT;

CREATE TABLE individual (
    id         INTEGER PRIMARY KEY,  -- over the whole run, in the order of birth
    generation INTEGER NOT NULL REFERENCES generation (number),
    number     INTEGER NOT NULL,     -- place in its generation, from 0
    genome     TEXT NOT NULL,        -- bits as hexadecimal, first bit first
    parent     INTEGER,              -- id of its parent in this run; NULL in generation 0
    ancestor   INTEGER,              -- id of its parent in parent_run; NULL but in generation 0 of a run with --from
    structure  TEXT,                 -- what the algorithm keeps besides the bits, as JSON (OGA: operons)
    fitness    REAL,                 -- NULL until all its trials are counted
    checksum   INTEGER,
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
    attempts   INTEGER NOT NULL,     -- of all kinds that it began
    ended      INTEGER NOT NULL,     -- of all kinds whose outcome it learned
    robot_s    REAL NOT NULL,        -- of these
    operator_s REAL NOT NULL,        -- of these
    versions   TEXT NOT NULL,        -- JSON: this package, Python, NumPy, Numba, plug-ins, processor, machine
    body       TEXT,                 -- fingerprint of the simulated body's code; NULL where there is none
    checksum   INTEGER
) STRICT;

CREATE TABLE measurement (
    id          INTEGER PRIMARY KEY,
    kind        TEXT NOT NULL,       -- what for, in a word: compare, repeat, ...
    begun_at    TEXT NOT NULL,
    finished_at TEXT,                -- NULL: interrupted; the same plan goes on with it
    robot       TEXT NOT NULL,       -- name of the robot
    config      TEXT NOT NULL,       -- YAML: the configuration that it is made with
    plan        TEXT NOT NULL,       -- JSON: what was asked for
    checksum    INTEGER
) STRICT;

CREATE TABLE start (
    id           INTEGER PRIMARY KEY,
    start_values TEXT NOT NULL UNIQUE, -- JSON list in the order of the robot's start fields
    checksum     INTEGER
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
    start       INTEGER NOT NULL REFERENCES start (id),
    noise_key   INTEGER NOT NULL,    -- 64 bits; printf('%016x', noise_key) shows them
    intent_at   INTEGER NOT NULL,    -- milliseconds since 1970, UTC; written before the trial starts
    ended_at    INTEGER,             -- the same; NULL: started, outcome not known
    end_reason  TEXT,
    steps       INTEGER,
    value       REAL,                -- what the task added up over the trial's steps; NULL if it adds up nothing
    state_hash  INTEGER,             -- CRC-16 of all neuron states
    final_state TEXT,                -- JSON list of 32-bit numbers in the order of the robot's state fields
    robot_s     REAL,
    fitness     REAL,                -- NULL for a void attempt: a failed trial is never a number
    operator_s  REAL,                -- time that a person needed before and after it; NULL if nobody was asked
    battery     REAL,                -- what the robot measured after it, as a fraction of a full one
    note        TEXT,                -- words of an operator, or why it is void
    checksum    INTEGER
) STRICT;

CREATE UNIQUE INDEX one_counted_result ON attempt (generation, individual, trial) WHERE fitness IS NOT NULL;
CREATE UNIQUE INDEX one_measured_result ON attempt (measurement, own_genome, individual, trial)
    WHERE fitness IS NOT NULL AND measurement IS NOT NULL;
CREATE INDEX attempt_of_another_kind ON attempt (kind, id) WHERE kind <> 'evolution';
CREATE INDEX attempt_with_battery ON attempt (id) WHERE battery IS NOT NULL;
CREATE INDEX individual_by_genome ON individual (genome);
CREATE INDEX generation_by_fitness ON generation (best_fitness);

CREATE TABLE batch (
    first      INTEGER PRIMARY KEY,  -- id of the first of many attempts that are being simulated in one call
    attempts   INTEGER NOT NULL,     -- how many, with consecutive ids; their rows take the place of this one
    session    INTEGER REFERENCES session (id),
    generation INTEGER NOT NULL REFERENCES generation (number),
    intent_at  INTEGER NOT NULL,     -- as in attempt
    slots      BLOB NOT NULL,        -- individual, trial, attempt (32 bits), start, noise_key (64): column after column
    checksum   INTEGER
) STRICT;

CREATE TABLE trace (
    attempt  INTEGER PRIMARY KEY REFERENCES attempt (id),
    format   TEXT NOT NULL,          -- how to read data
    data     BLOB NOT NULL,          -- what a robot sent that could not be computed again
    checksum INTEGER
) STRICT;

CREATE TABLE event (
    id         INTEGER PRIMARY KEY,
    at         TEXT NOT NULL,
    generation INTEGER,
    kind       TEXT NOT NULL,        -- started, resumed, stopped, finished, operator, suspended, versions, damage, ...
    message    TEXT NOT NULL,
    checksum   INTEGER
) STRICT;
"""

COLUMNS = {
    "run": "only_row name created_at root_seed config versions parent_run",
    "robot": "only_row spec",
    "generation": "number started_at state_checksum begun_digest finished_at wall_s attempts robot_s operator_s "
    "best_fitness mean_fitness worst_fitness success_rate last_attempt digest",
    "individual": "id generation number genome parent ancestor structure fitness",
    "session": "id started_at robot operators limits wall_s paused_s attempts ended robot_s operator_s versions body",
    "measurement": "id kind begun_at finished_at robot config plan",
    "start": "id start_values",
    "attempt": "id kind session measurement generation individual trial attempt own_genome start noise_key intent_at "
    "ended_at end_reason steps value state_hash final_state robot_s fitness operator_s battery note",
    "batch": "first attempts session generation intent_at slots",
    "trace": "attempt format data",
    "event": "id at generation kind message",
}
"""The columns that a row's checksum is made of, in order; tables that others refer to come first."""


def columns_of(table: str) -> list[str]:
    """Names of the columns that a row's checksum is made of."""
    return COLUMNS[table].split()


def statements(schema: str) -> Iterator[str]:
    """The statements of a schema, one after the other: SQLite's own way of running many of them would commit."""
    statement = ""
    for line in schema.splitlines(keepends=True):
        statement += line
        if sqlite3.complete_statement(statement):
            yield statement
            statement = ""

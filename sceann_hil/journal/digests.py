"""What a generation was when it began and when it was finished, as SHA-256, each chained to the one before.

A row's checksum tells of a changed row; the chain tells of rows that are missing, too many, or of another run.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3

import numpy as np

from sceann_hil.journal.schema import columns_of

_FIGURES = (
    "number, finished_at, wall_s, attempts, robot_s, operator_s, best_fitness, mean_fitness, worst_fitness, "
    "success_rate, last_attempt"
)


def run_digest(db: sqlite3.Connection) -> str:
    """Of the run itself: what generation 0 follows."""
    row = db.execute(f"SELECT {', '.join(columns_of('run'))} FROM run").fetchone()
    return hashlib.sha256(json.dumps(row).encode()).hexdigest()


def begun_digest(db: sqlite3.Connection, number: int, before: str) -> str:
    """Of a generation as it began.

    Args:
        db: the journal.
        number: of the generation.
        before: digest of the finished generation before, or of the run.
    """
    started_at, state = db.execute(
        "SELECT started_at, algorithm_state FROM generation WHERE number = ?", (number,)
    ).fetchone()
    individuals = db.execute(
        "SELECT id, number, genome, parent, ancestor, structure FROM individual WHERE generation = ? ORDER BY number",
        (number,),
    ).fetchall()
    digest = hashlib.sha256(json.dumps([before, number, started_at, individuals]).encode())
    digest.update(state)
    return digest.hexdigest()


def finished_digest(db: sqlite3.Connection, number: int, begun: str) -> str:
    """Of a finished generation: its figures, its individuals and the attempts of all kinds since the one before.

    Args:
        db: the journal.
        number: of the generation.
        begun: its `begun_digest`.
    """
    figures = db.execute(f"SELECT {_FIGURES} FROM generation WHERE number = ?", (number,)).fetchone()
    before = db.execute("SELECT coalesce(max(last_attempt), 0) FROM generation WHERE number < ?", (number,)).fetchone()
    digest = hashlib.sha256(json.dumps([begun, *figures]).encode())
    for question, values in (
        ("SELECT checksum FROM individual WHERE generation = ? ORDER BY number", (number,)),
        ("SELECT checksum FROM attempt WHERE id > ? AND id <= ? ORDER BY id", (before[0], figures[-1])),
    ):
        checksums = [row[0] for row in db.execute(question, values).fetchall()]
        digest.update(np.array(checksums, "<u8").tobytes())
    return digest.hexdigest()


def digest_before(db: sqlite3.Connection, number: int) -> str:
    """What a generation's `begun_digest` follows."""
    row = db.execute("SELECT digest FROM generation WHERE number = ?", (number - 1,)).fetchone()
    return run_digest(db) if row is None else str(row[0])

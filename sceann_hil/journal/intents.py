"""What is written of attempts before they start: a row for each, or one row for a large batch.

A simulation runs thousands of trials in one call. Their intents stand in one row of the table ``batch``, which gives
way to a row for each attempt in the transaction that brings their results. Where a process was cut off in between,
`Intents.spread` makes the rows that would have been there, so that nobody else need know of batches.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.journal.checksums import Column, row_checksums
from sceann_hil.journal.entries import AttemptKind
from sceann_hil.journal.insertion import insert_columns, insert_row
from sceann_hil.journal.reader import JournalReader
from sceann_hil.journal.schema import columns_of

INTENT = columns_of("attempt")[:12]
RESULT = columns_of("attempt")[12:]
LARGE = 64
"""Attempts of evolution in one call of the robot from which on they are a batch."""
_NOT_YET: tuple[Column, ...] = (None,) * len(RESULT)
_SLOTS = ("<i4", "<i4", "<i4", "<i8", "<i8")


@dataclass(frozen=True, slots=True)
class Written:
    """Intents that stand in the journal and nothing else of them does.

    Attributes:
        ids: of the attempts.
        columns: of `INTENT`.
        as_batch: in one row of the table ``batch``.
    """

    ids: NDArray[np.int64]
    columns: list[Column]
    as_batch: bool


class Intents:
    """Writes intents; every method is called within a transaction.

    Args:
        db: the journal.
        reader: its reading side.
    """

    def __init__(self, db: sqlite3.Connection, reader: JournalReader) -> None:
        self._db = db
        self._reader = reader
        self._starts: dict[bytes, int] = {}

    def write(self, columns: list[Column], n: int) -> Written:
        """n attempts are about to start; see `INTENT` for the columns, the first of which are consecutive ids."""
        ids = np.asarray(columns[0], np.int64)
        kind, session, generation, intent_at = columns[1], columns[2], columns[4], columns[11]
        as_batch = n >= LARGE and kind == AttemptKind.EVOLUTION.value
        if as_batch:
            slots = pack_slots([columns[place] for place in (5, 6, 7, 9, 10)])
            insert_row(self._db, "batch", (int(ids[0]), n, session, generation, intent_at, slots))
        else:
            insert_columns(self._db, "attempt", INTENT, columns, row_checksums([*columns, *_NOT_YET], n), n)
        return Written(ids, columns, as_batch)

    def forget(self, batch: Written) -> None:
        """The rows of a batch's attempts take its place."""
        self._db.execute("DELETE FROM batch WHERE first = ?", (int(batch.ids[0]),))

    def spread(self) -> None:
        """Put a row for each attempt in the place of every batch."""
        for first, n, session, generation, intent_at, data in self._reader.rows("batch", "ORDER BY first"):
            individual, trial, attempt, start, key = unpack_slots(data, n)
            columns: list[Column] = [
                *(np.arange(first, first + n), AttemptKind.EVOLUTION.value, session, None, generation),
                *(individual, trial, attempt, None, start, key, intent_at),
            ]
            insert_columns(self._db, "attempt", INTENT, columns, row_checksums([*columns, *_NOT_YET], n), n)
            self._db.execute("DELETE FROM batch WHERE first = ?", (first,))

    def start_ids(self, starts: NDArray[np.float64]) -> NDArray[np.int64]:
        """Ids of start values, shape ``(n, n_start)``; new ones are written."""
        raw, width = np.ascontiguousarray(starts, np.float64).tobytes(), 8 * starts.shape[1]
        if not width:
            return np.full(len(starts), self._start_id(b""))
        keys = [raw[k : k + width] for k in range(0, len(raw), width)]
        for key in set(keys).difference(self._starts):
            self._starts[key] = self._start_id(key)
        return np.array([self._starts[key] for key in keys], np.int64)

    def _start_id(self, key: bytes) -> int:
        text = json.dumps(np.frombuffer(key, np.float64).tolist())
        known = self._db.execute("SELECT id FROM start WHERE start_values = ?", (text,)).fetchone()
        if known is not None:
            return int(known[0])
        identity = 1 + int(self._reader.one("SELECT coalesce(max(id), 0) FROM start")[0])
        insert_row(self._db, "start", (identity, text))
        return identity


def pack_slots(columns: Sequence[Column]) -> bytes:
    """Individual, trial, attempt, start and noise key of some attempts: integers, column after column."""
    return b"".join(np.asarray(column).astype(dtype).tobytes() for column, dtype in zip(columns, _SLOTS, strict=True))


def unpack_slots(data: bytes, n: int) -> list[NDArray[np.int64]]:
    """The inverse of `pack_slots`, for n attempts.

    Raises:
        ValueError: of another length.
    """
    columns, place = [], 0
    if len(data) != n * sum(np.dtype(dtype).itemsize for dtype in _SLOTS):
        raise ValueError(f"a batch of {n} attempts has {len(data)} bytes")
    for dtype in _SLOTS:
        columns.append(np.frombuffer(data, dtype, n, place).astype(np.int64))
        place += n * np.dtype(dtype).itemsize
    return columns

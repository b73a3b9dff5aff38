"""Attempts of trials between arrays, rows of the database, and `AttemptRow`."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from sceann_hil.journal.entries import AttemptKind
from sceann_hil.journal.rows import AttemptRow
from sceann_hil.robot import EndReason

_REASONS = {reason.name.lower(): reason for reason in EndReason}
_MASK = 2**64 - 1
Starts = Mapping[int, tuple[float, ...]]
"""Start values by their id; schema 1 has them in the attempt itself."""


def attempt_rows(rows: list[tuple[Any, ...]], starts: Starts) -> list[AttemptRow]:
    """Many rows at once.

    Args:
        rows: of the table ``attempt``, in the order of its columns.
        starts: start values by id.

    Raises:
        ValueError, KeyError: something in them is not as this program writes it.
    """
    states = final_states_of([row[17] for row in rows])
    return [attempt_row(row, starts, state) for row, state in zip(rows, states, strict=True)]


def attempt_row(row: tuple[Any, ...], starts: Starts, state: tuple[float, ...] | None = None) -> AttemptRow:
    """One row; see `attempt_rows`. `state` is its final state if that is known already."""
    if state is None and row[17] is not None:
        (state,) = final_states_of([row[17]])
    return AttemptRow(
        id=row[0],
        kind=AttemptKind(row[1]),
        session=row[2],
        measurement=row[3],
        generation=row[4],
        individual=row[5],
        trial=row[6],
        attempt=row[7],
        genome=row[8],
        start=starts[row[9]] if isinstance(row[9], int) else tuple(json.loads(row[9])),
        noise_key=row[10] & _MASK,
        end_reason=None if row[13] is None else _REASONS[row[13]],
        steps=row[14],
        value=row[15],
        state_hash=row[16],
        final_state=state,
        robot_s=row[18],
        fitness=row[19],
        operator_s=row[20],
        battery=row[21],
        note=row[22],
    )


def final_state_texts(states: NDArray[np.float32]) -> list[str]:
    """Body states, shape ``(n, n_state)``, as JSON lists whose numbers are the shortest that give the same 32 bits."""
    n, n_state = states.shape
    if n_state == 0 or not np.isfinite(states).all():
        return [json.dumps(state) for state in states.tolist()]
    contiguous = np.ascontiguousarray(states, np.float32)
    text = orjson.dumps(contiguous, option=orjson.OPT_SERIALIZE_NUMPY).decode()
    return text[1:-1].replace("],[", "] [").split(" ") if n else []


def final_states_of(texts: Sequence[str | None]) -> list[tuple[float, ...] | None]:
    """The inverse of `final_state_texts`; None stays None.

    Raises:
        ValueError: no JSON list of numbers.
    """
    known = [text for text in texts if text is not None]
    try:
        states = np.array(orjson.loads(f"[{','.join(known)}]"), np.float32)
        if states.ndim != 2 or len(states) != len(known):
            raise ValueError("states of several lengths")
        parsed = iter([tuple(state) for state in states.tolist()])
    except (ValueError, TypeError):
        # several lengths, or numbers that are none in JSON proper
        parsed = iter([tuple(np.array(json.loads(text), np.float32).tolist()) for text in known])
    return [None if text is None else next(parsed) for text in texts]

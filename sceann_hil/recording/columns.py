"""Chunks from archetypes: the few shapes of data that all recordings are made of."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
import pyarrow as pa  # type: ignore[import-untyped]
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk
from rerun.encodings.rotation_axis_angle import RotationAxisAngleBatch

rr.set_strict_mode(True)  # otherwise data of a wrong shape are dropped with a warning

TRIAL_TIME = "trial_time"
STEP = "step"
GENERATION = "generation"


@lru_cache(maxsize=4096)
def step_times(count: int, tick_s: float) -> tuple[rr.TimeColumn, rr.TimeColumn]:
    """Both timelines of a trial for steps 0 to ``count - 1``."""
    return times_of(np.arange(count), tick_s)


def times_of(steps: NDArray[np.integer], tick_s: float) -> tuple[rr.TimeColumn, rr.TimeColumn]:
    """Both timelines of a trial for some steps."""
    nanoseconds = np.rint(steps * (tick_s * 1e9)).astype("timedelta64[ns]")
    return rr.TimeColumn(TRIAL_TIME, duration=nanoseconds), rr.TimeColumn(STEP, sequence=np.asarray(steps, np.int64))


def at_generation(number: int) -> tuple[rr.TimeColumn]:
    """The run overview's timeline."""
    return (rr.TimeColumn(GENERATION, sequence=[number]),)


def columns_of(archetype: rr.AsComponents) -> list[rr.ComponentColumn]:
    """All of an archetype's components as one row."""
    return [
        rr.ComponentColumn(batch.component_descriptor(), batch, lengths=[len(batch.as_arrow_array())])
        for batch in archetype.as_component_batches()
    ]


def static(path: str, archetype: rr.AsComponents) -> Chunk:
    """One row that holds at all times."""
    return Chunk.from_columns(path, indexes=(), columns=columns_of(archetype))


def timed(path: str, times: Iterable[rr.TimeColumn], columns: Iterable[rr.ComponentColumn]) -> Chunk:
    """Many rows, one for each time."""
    return Chunk.from_columns(path, indexes=times, columns=columns)


def once(path: str, times: Iterable[rr.TimeColumn], archetype: rr.AsComponents) -> Chunk:
    """One row at one time."""
    return Chunk.from_columns(path, indexes=times, columns=columns_of(archetype))


def several(columns: rr.ComponentColumnList, rows: int, per_row: int) -> rr.ComponentColumnList:
    """Columns of flat data with `per_row` instances in each of `rows` rows."""
    return columns.partition(np.full(rows, per_row, np.int64))


def scalars(values: NDArray[np.floating | np.integer]) -> rr.ComponentColumnList:
    """Curves, shape ``(n_steps, n_curves)``."""
    return rr.Scalars.columns(scalars=np.ascontiguousarray(values, np.float64))


_AXIS_ANGLE = RotationAxisAngleBatch._ARROW_DATATYPE


def poses(
    translation: NDArray[np.float32] | None, angle_rad: NDArray[np.float32] | None = None
) -> rr.ComponentColumnList:
    """Moves and turns about z; the numbers are stored as they are, so a recording can be compared bit for bit.

    Args:
        translation: shape ``(n, 3)``, or None.
        angle_rad: shape ``(n,)``, or None.
    """
    turns = None
    if angle_rad is not None:
        axis = np.tile(np.array([0.0, 0.0, 1.0], np.float32), len(angle_rad))
        vectors = pa.FixedSizeListArray.from_arrays(pa.array(axis), type=_AXIS_ANGLE.field(0).type)
        angles = pa.array(np.ascontiguousarray(angle_rad, np.float32))
        fields = [_AXIS_ANGLE.field(i) for i in range(2)]
        turns = pa.StructArray.from_arrays([vectors, angles], fields=fields)
    return rr.Transform3D.columns(translation=translation, rotation_axis_angle=turns)

"""What a distance sensor reads at which distance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from backends.world.layout import NODES


def fitted(table: Sequence[tuple[float, float]], range_m: float) -> tuple[float, ...]:
    """A curve through measured readings; several readings of one distance are averaged.

    Nearer than the nearest distance it reads as there; from the farthest on it falls to 0 at the range.

    Args:
        table: distance in metres and reading 0..1, in any order.
        range_m: of the sensor.

    Returns:
        Readings at `NODES` equal steps of distance.
    """
    distances, which = np.unique([distance for distance, _ in table], return_inverse=True)
    sums = np.bincount(which, weights=[reading for _, reading in table])
    readings = sums / np.bincount(which)
    if distances[-1] < range_m:
        distances, readings = np.append(distances, range_m), np.append(readings, 0.0)
    at = np.linspace(0.0, range_m, NODES)
    return tuple(np.interp(at, distances, readings).tolist())

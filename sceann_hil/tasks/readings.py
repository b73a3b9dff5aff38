"""The strongest or weakest reading of some sensors, for the values of steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sceann_hil.network.compiled import compiled_part
from sceann_hil.robot.step_value import Floats, max_of, min_of


def strongest(numbers: Sequence[int]) -> Callable[[Floats], float]:
    """The largest reading of these sensors; of all if there are no numbers."""
    chosen = np.array(numbers, np.int64)
    if not len(chosen):
        return max_of

    @compiled_part
    def largest(sensors: Floats) -> float:
        most = 0.0
        for number in chosen:
            most = max(most, sensors[number])
        return float(most)

    return largest


def weakest(numbers: Sequence[int]) -> Callable[[Floats], float]:
    """The smallest reading of these sensors; of all if there are no numbers."""
    chosen = np.array(numbers, np.int64)
    if not len(chosen):
        return min_of

    @compiled_part
    def smallest(sensors: Floats) -> float:
        least = 1.0
        for number in chosen:
            least = min(least, sensors[number])
        return float(least)

    return smallest

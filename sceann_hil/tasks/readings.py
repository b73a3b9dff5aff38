"""The strongest or weakest reading of some sensors, for the values of steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from sceann_hil.network.compiled import compiled_part
from sceann_hil.robot.step_value import Floats, max_of, min_of


def strongest(numbers: Sequence[int]) -> Callable[[Floats], float]:
    """The largest reading of these sensors; of all if there are no numbers."""
    return _extreme(numbers, max, 0.0) if numbers else max_of


def weakest(numbers: Sequence[int]) -> Callable[[Floats], float]:
    """The smallest reading of these sensors; of all if there are no numbers."""
    return _extreme(numbers, min, 1.0) if numbers else min_of


def _extreme(numbers: Sequence[int], of_two: Callable[..., Any], first: float) -> Callable[[Floats], float]:
    chosen = np.array(numbers, np.int64)

    @compiled_part
    def extreme(sensors: Floats) -> float:
        found = first
        for number in chosen:
            found = of_two(found, sensors[number])
        return float(found)

    return extreme

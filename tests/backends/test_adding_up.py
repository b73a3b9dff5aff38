"""Values added up in the lanes see the same numbers as values of a trace, to the last bit."""

from __future__ import annotations

import numba
import numpy as np

from backends.simulation.adding_up import part_of_full_scale
from sceann_hil.network.controller import SENSOR_MAX


def test_every_wire_value_is_divided_exactly() -> None:
    @numba.njit
    def parts(wire: np.ndarray) -> np.ndarray:
        out = np.empty(len(wire))
        for i in range(len(wire)):
            out[i] = part_of_full_scale(wire[i])
        return out

    wire = np.arange(SENSOR_MAX + 1, dtype=np.uint16)
    assert np.array_equal(parts(wire), wire / float(SENSOR_MAX))

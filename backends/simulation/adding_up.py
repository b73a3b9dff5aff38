"""The value of each lane's step, added to the lane's total while trials run side by side.

The numbers of sensors, motors and states are constants of the machine code, and what a value sees lies in arrays of a
lane's own that are never in memory: so the compiler turns most values into vector code over the lanes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array
from numpy.typing import NDArray

from backends.simulation.body import Float32Array
from sceann_hil.network.compiled import compiled_part, rebound
from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.network.neurons import LANES
from sceann_hil.robot.accumulation import Accumulation, combined
from sceann_hil.robot.facts import RobotSpec

_HIGH = np.round(2.0**52 / SENSOR_MAX) / 2.0**52
_LOW = float(np.longdouble(1.0) / SENSOR_MAX - np.longdouble(_HIGH))

value: Any = None
"""A `StepValue.part`, in the globals that `accumulating` makes."""
N_SENSORS = N_MOTORS = N_STATE = N_SEEN = RULE = 0


@compiled_part
def nothing(
    state: Float32Array, wire: NDArray[np.uint16], outputs: NDArray[np.int16], totals: NDArray[np.float64]
) -> None:
    """For a task that adds nothing up."""


def accumulating(accumulation: Accumulation, spec: RobotSpec) -> Callable[..., None]:
    """Adds the value of one step to each lane's total; for `run_lanes` with a robot like this."""
    step_value = accumulation.value
    n_state = len(spec.state_fields)
    constants: dict[str, Any] = {
        "N_SENSORS": spec.n_sensors,
        "N_MOTORS": spec.n_motors,
        "N_STATE": n_state,
        "N_SEEN": n_state if step_value.uses_state else 0,
        "RULE": accumulation.rule,
    }
    return compiled_part(rebound(_accumulate, value=step_value.part, **constants))


def _accumulate(
    state: Float32Array, wire: NDArray[np.uint16], outputs: NDArray[np.int16], totals: NDArray[np.float64]
) -> None:
    first_motor = outputs.shape[0] - N_MOTORS
    sensors, motors, own_state = _array(N_SENSORS), _array(N_MOTORS), _array(N_STATE)
    for lane in range(LANES):
        for j in range(N_SENSORS):
            sensors[j] = part_of_full_scale(wire[j, lane])
        for m in range(N_MOTORS):
            motors[m] = outputs[first_motor + m, lane] * (1.0 / ONE)
        for k in range(N_SEEN):
            own_state[k] = state[k, lane]
        totals[lane] = combined(totals[lane], value(sensors, motors, own_state), RULE)


@compiled_part
def part_of_full_scale(wire: np.uint16) -> float:
    """A wire value divided by its largest, to the last bit, without a division (a test tries all of them)."""
    number = np.float64(wire)
    return float(number * _HIGH + number * _LOW)


@intrinsic
def lane_array(typing_context: Any, length: Any) -> Any:
    """An array of so many float64 numbers, a constant, that lives as long as the function that asks for it."""
    if not isinstance(length, types.IntegerLiteral):
        return None
    n = length.literal_value
    array_type = types.Array(types.float64, 1, "C")

    def generate(context: Any, builder: Any, signature: Any, _: Any) -> Any:
        place = cgutils.alloca_once(builder, ir.ArrayType(ir.DoubleType(), n))  # type: ignore[no-untyped-call]
        array = make_array(array_type)(context, builder)  # type: ignore[no-untyped-call]
        populate_array(  # type: ignore[no-untyped-call]
            array,
            data=builder.bitcast(place, ir.DoubleType().as_pointer()),
            shape=(context.get_constant(types.intp, n),),
            strides=(context.get_constant(types.intp, 8),),
            itemsize=context.get_constant(types.intp, 8),
            meminfo=None,
        )
        return array._getvalue()

    return array_type(length), generate


_array: Any = lane_array

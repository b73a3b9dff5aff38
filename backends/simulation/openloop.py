"""A simulated body driven by given motor values, whatever its sensors say: many trials side by side, on one core.

What the sensors read is kept as it is before a controller sees it: neither clipped to 0..1 nor rounded.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from backends.simulation.body import Float32Array, SimulatedBody
from backends.simulation.lanes import WORK_ROWS, fill_normals
from sceann_hil.network.neurons import LANES

_U = np.uint32

sense: Any = None
"""The body's, in the globals that `SimulatedBody.bind` makes."""
advance: Any = None


def drive(
    robot: SimulatedBody, starts: NDArray[np.float64], motors: Float32Array, keys: NDArray[np.uint64]
) -> Float32Array:
    """What the body's sensors read while its motors are driven.

    A body that comes to the end of its task goes on moving.

    Args:
        robot: whose body; its gap is left out.
        starts: start values of each trial, shape ``(n, n_start)``.
        motors: what the motors do, 0..1, shape ``(n, steps, n_motors)``.
        keys: noise key of each trial, shape ``(n,)``.

    Returns:
        Sensor values before each step, shape ``(n, steps, n_sensors)``.
    """
    sensed = np.zeros((*motors.shape[:2], robot.spec.n_sensors), np.float32)
    states = robot.checked_states(starts, keys)
    robot.bind(_drive)(
        states, np.ascontiguousarray(motors), keys, *robot.noise_rows, robot.checked_parameters(), sensed
    )
    return sensed


def _drive(
    states: Float32Array,
    commands: Float32Array,
    keys: NDArray[np.uint64],
    n_noise: int,
    n_drawn: int,
    parameters: Float32Array,
    sensed: Float32Array,
) -> None:
    n_trials, n_steps, n_motors = commands.shape
    n_sensors, n_state = sensed.shape[2], states.shape[1]
    state = np.zeros((n_state, LANES), np.float32)
    sensors = np.zeros((n_sensors, LANES), np.float32)
    motors = np.zeros((n_motors, LANES), np.float32)
    noise = np.zeros((n_noise, LANES), np.float32)
    work = np.zeros((WORK_ROWS, LANES), np.float32)
    ended = np.zeros(LANES, np.int32)
    key_low = np.zeros(LANES, np.uint32)
    key_high = np.zeros(LANES, np.uint32)
    step = np.zeros(LANES, np.int32)
    for first in range(0, n_trials, LANES):
        n = min(LANES, n_trials - first)
        for lane in range(n):
            key_low[lane] = _U(keys[first + lane])
            key_high[lane] = _U(keys[first + lane] >> np.uint64(32))
            for k in range(n_state):
                state[k, lane] = states[first + lane, k]
        step[:] = 0
        for t in range(n_steps):
            sense(state, sensors, work, parameters)
            for j in range(n_sensors):
                for lane in range(n):
                    sensed[first + lane, t, j] = sensors[j, lane]
            for m in range(n_motors):
                for lane in range(n):
                    motors[m, lane] = commands[first + lane, t, m]
            for k in range(0, n_drawn, 2):
                fill_normals(noise, k, key_low, key_high, step)
            advance(state, motors, noise, ended, work, parameters)
            for lane in range(LANES):
                step[lane] += np.int32(1)

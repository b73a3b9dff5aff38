"""One network stepped with sensors as they come, compiled: what a robot in a loop of Python calls at every tick.

Bit for bit the neuron of `sceann_hil.network.controller`; see there for the arithmetic.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import NetworkSize, Weights
from sceann_hil.network.compiled import compiled, compiled_part
from sceann_hil.network.controller import ONE, SENSOR_MAX, THRESHOLD, Dynamics, Neuron
from sceann_hil.network.neurons import interpolate


class SingleNetwork:
    """One network and the record of its steps.

    Attributes:
        sensors: wire values 0..1023 of each step, uint16, shape ``(max_steps, n_sensors)``.
        u: neuron states after each step, int16 Q10, shape ``(max_steps, n_neurons)``.
        x: neuron outputs after each step, int16 Q10, shape ``(max_steps, n_neurons)``.

    Args:
        weights: shape ``(n_neurons, n_sources)``.
        size: the network's size.
        dynamics: the neuron's reading and initial output.
        max_steps: how many steps there may be.
    """

    def __init__(self, weights: Weights, size: NetworkSize, dynamics: Dynamics, max_steps: int) -> None:
        self.sensors = np.zeros((max_steps, size.n_sensors), np.uint16)
        self.u = np.zeros((max_steps, size.n_neurons), np.int16)
        self.x = np.zeros((max_steps, size.n_neurons), np.int16)
        self._weights = np.ascontiguousarray(weights, np.int8)
        self._memoryless = dynamics.neuron is Neuron.MEMORYLESS
        self._now = np.zeros((3, size.n_neurons), np.int32)
        self._motors = np.zeros(size.n_motors, np.float64)
        if not getattr(_step, "signatures", ()):
            # a tick must not wait for machine code that is not loaded yet
            self.step(0, np.zeros(size.n_sensors))
            self._now[:] = 0
        self._now[1] = dynamics.initial_output

    def step(self, step: int, values: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """One control step.

        Args:
            step: its number, from 0.
            values: of the sensors, each 0..1, float64, shape ``(n_sensors,)``.

        Returns:
            Motor values, each 0..1, float64, shape ``(n_motors,)``; None if a sensor's value is no number.
        """
        motors = self._motors
        is_number = _step(
            step, values, self._weights, self._now, self.sensors, self.u, self.x, motors, self._memoryless
        )
        return motors.copy() if is_number else None


@compiled
def _step(
    step: int,
    values: NDArray[np.float64],
    weights: NDArray[np.int8],
    now: NDArray[np.int32],
    sensors: NDArray[np.uint16],
    u: NDArray[np.int16],
    x: NDArray[np.int16],
    motors: NDArray[np.float64],
    memoryless: bool,
) -> bool:
    for j in range(values.shape[0]):
        value = values[j]
        if not np.isfinite(value):
            return False
        sensors[step, j] = np.uint16(np.floor(SENSOR_MAX * min(max(value, 0.0), 1.0) + 0.5))
    step_neurons(weights, now, sensors[step], memoryless)
    n_neurons, n_motors = now.shape[1], motors.shape[0]
    for i in range(n_neurons):
        u[step, i] = np.int16(now[0, i])
        x[step, i] = np.int16(now[1, i])
    for m in range(n_motors):
        motors[m] = now[1, n_neurons - n_motors + m] / float(ONE)
    return True


@compiled_part
def step_neurons(weights: NDArray[np.int8], now: NDArray[np.int32], wire: NDArray[np.uint16], memoryless: bool) -> None:
    """All neurons at once, from the outputs as they were.

    Args:
        weights: shape ``(n_neurons, n_sources)``.
        now: states, outputs, and scratch, shape ``(3, n_neurons)``; updated.
        wire: wire values 0..1023 of the sensors, shape ``(n_sensors,)``.
        memoryless: which reading of Eq. (1).
    """
    n_neurons, n_sensors = now.shape[1], wire.shape[0]
    for i in range(n_neurons):
        total = np.int32(0) if memoryless else now[0, i]
        for j in range(n_sensors):
            r = np.int32(wire[j])
            total += np.int32(weights[i, j]) * np.int32(r + (r >> np.int32(9)))
        for k in range(n_neurons):
            total += np.int32(weights[i, n_sensors + k]) * now[1, k]
        now[2, i] = total
    for i in range(n_neurons):
        reset = abs(now[2, i]) > THRESHOLD
        now[0, i] = np.int32(0) if reset else now[2, i]
        now[1, i] = np.int32(0) if reset and memoryless else np.int32(interpolate(np.int16(now[0, i])))

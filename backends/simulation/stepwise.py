"""A simulated body moved one tick at a time, by motor values that come from elsewhere.

The bits are those of the lane engine: a trial whose motor values come from the same network ends in the same state
after the same steps. That is what hardware-in-the-loop trials and virtual robots are built on.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from backends.simulation.body import Float32Array, SimulatedBody
from backends.simulation.gap import GAP_FIXED, MAX_LATENCY_STEPS, Gap, apply_motor_gap, apply_sensor_gap
from backends.simulation.lanes import RUNNING, WORK_ROWS, fill_normals
from sceann_hil.network.controller import ONE
from sceann_hil.network.neurons import LANES
from sceann_hil.robot import EndReason

_F = np.float32

sense: Any = None
advance: Any = None


def _read_sensors(
    state: Float32Array,
    sensors: Float32Array,
    work: Float32Array,
    parameters: Float32Array,
    lane_gap: Float32Array,
    key_low: NDArray[np.uint32],
    key_high: NDArray[np.uint32],
    step: NDArray[np.int32],
    wire: NDArray[np.uint16],
) -> None:
    sense(state, sensors, work, parameters)
    if lane_gap.shape[0] > 0:
        apply_sensor_gap(sensors, lane_gap, key_low, key_high, step)
    for j in range(sensors.shape[0]):
        clipped = min(max(sensors[j, 0], _F(0.0)), _F(1.0))
        wire[j] = np.uint16(np.int32(clipped * _F(1023.0) + _F(0.5)))


def _move(
    state: Float32Array,
    motors: Float32Array,
    noise: Float32Array,
    ended: NDArray[np.int32],
    work: Float32Array,
    parameters: Float32Array,
    lane_gap: Float32Array,
    delayed: Float32Array,
    n_sensors: int,
    n_drawn: int,
    key_low: NDArray[np.uint32],
    key_high: NDArray[np.uint32],
    step: NDArray[np.int32],
) -> None:
    if lane_gap.shape[0] > 0:
        apply_motor_gap(motors, delayed, lane_gap, n_sensors)
    for k in range(0, n_drawn, 2):
        fill_normals(noise, k, key_low, key_high, step)
    advance(state, motors, noise, ended, work, parameters)
    for lane in range(LANES):
        step[lane] += np.int32(1)


class StepwiseBody:
    """One body of a simulated robot.

    Args:
        robot: whose body it is.
        gap: instead of the robot's own gap.

    Attributes:
        robot: whose body it is.
        state: body state now, float32, shape ``(n_state,)`` (a view).
        steps: ticks since `reset`.
    """

    def __init__(self, robot: SimulatedBody, gap: Gap | None = None) -> None:
        self.robot = robot
        self._gap = robot.gap if gap is None else gap
        spec = robot.spec
        self._read_sensors, self._move = robot.bind(_read_sensors), robot.bind(_move)
        n_noise, self._n_drawn = robot.noise_rows
        self._parameters = robot.checked_parameters()
        self._state = np.zeros((len(spec.state_fields), LANES), np.float32)
        self._sensors = np.zeros((spec.n_sensors, LANES), np.float32)
        self._motors = np.zeros((spec.n_motors, LANES), np.float32)
        self._noise = np.zeros((n_noise, LANES), np.float32)
        self._work = np.zeros((WORK_ROWS, LANES), np.float32)
        self._wire = np.zeros(spec.n_sensors, np.uint16)
        self._ended = np.full(LANES, RUNNING, np.int32)
        self._step = np.zeros(LANES, np.int32)
        self._delayed = np.zeros((MAX_LATENCY_STEPS + 1, spec.n_motors, LANES), np.float32)
        self.reset(np.zeros(len(spec.start_fields)), np.uint64(0))

    def reset(self, start: NDArray[np.float64], key: np.uint64) -> None:
        """Put the body where a trial starts.

        Args:
            start: values in the order of the robot's start fields.
            key: noise key; the gap is drawn from it.
        """
        spec = self.robot.spec
        keys = np.array([key], np.uint64)
        self._state[:] = self.robot.checked_states(np.asarray(start, np.float64)[None], keys)[0][:, None]
        gap = self._gap.draw(keys, spec.n_sensors, spec.n_motors, self.robot.neutral_motor)
        self._lane_gap = np.repeat(gap.T, LANES, axis=1) if len(gap) else np.zeros((0, LANES), np.float32)
        self._lane_gap = np.ascontiguousarray(self._lane_gap)
        if len(gap):
            self._delayed[:] = self._lane_gap[GAP_FIXED - 1, 0]
        self._key_low = np.full(LANES, int(key) & 0xFFFFFFFF, np.uint32)
        self._key_high = np.full(LANES, int(key) >> 32, np.uint32)
        self._step[:] = 0

    def prepare(self) -> None:
        """Load or make the machine code, so that no tick of a trial waits for it; the body is where it was made."""
        self.sense()
        self.move([0] * self.robot.spec.n_motors)
        self.reset(np.zeros(len(self.robot.spec.start_fields)), np.uint64(0))

    @property
    def state(self) -> NDArray[np.float32]:
        return self._state[:, 0]

    @property
    def steps(self) -> int:
        return int(self._step[0])

    def sense(self) -> NDArray[np.uint16]:
        """Wire values 0..1023 that the sensors read now, uint16, shape ``(n_sensors,)`` (valid until the next call)."""
        self._read_sensors(
            self._state,
            self._sensors,
            self._work,
            self._parameters,
            self._lane_gap,
            self._key_low,
            self._key_high,
            self._step,
            self._wire,
        )
        return self._wire

    def move(self, motors: Sequence[int]) -> EndReason | None:
        """One tick with these motor values in Q10, after `sense`; why the trial ended, or None if it goes on."""
        for m, value in enumerate(motors):
            self._motors[m] = _F(value) * _F(1.0 / ONE)
        self._move(
            self._state,
            self._motors,
            self._noise,
            self._ended,
            self._work,
            self._parameters,
            self._lane_gap,
            self._delayed,
            self.robot.spec.n_sensors,
            self._n_drawn,
            self._key_low,
            self._key_high,
            self._step,
        )
        return None if self._ended[0] == RUNNING else EndReason(int(self._ended[0]))

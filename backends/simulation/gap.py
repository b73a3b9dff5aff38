"""The reality gap: how a simulated body can be as imperfect as a real one.

Every quantity is a fixed number or drawn from the seed tree: anew for each trial, or once for a robot's whole life.
With all at their defaults the simulation is the paper's and costs nothing extra.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from backends.simulation.noise import CHANNELS, normal_pair
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES
from sceann_hil.seeds import Purpose, keys, uniforms

_F = np.float32
_U = np.uint32
FIRST_SENSOR_CHANNEL = 16
"""Each sensor uses two noise channels from here on; a body's own noise uses those below."""

MAX_LATENCY_STEPS = 15

GAP_FIXED = 4
"""Rows of a lane's gap before the per-sensor and per-motor ones: sensor noise, dead band, latency, neutral motor."""


@dataclass(frozen=True, slots=True)
class Spread:
    """One gap parameter: a fixed number, or drawn for every trial or robot (and sensor or motor).

    Attributes:
        centre: the number, the middle of a uniform range, or the mean of a normal distribution.
        half_width: half of a uniform range; 0 for none.
        deviation: standard deviation of a normal distribution; 0 for none.
    """

    centre: float
    half_width: float = 0.0
    deviation: float = 0.0

    def draw(self, rng_uniform: NDArray[np.float64], rng_normal: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values from uniform deviates in [0, 1) and standard normal deviates of the same shape."""
        return self.centre + self.half_width * (2.0 * rng_uniform - 1.0) + self.deviation * rng_normal


Spreads = Spread | tuple[Spread, ...]
"""One for all sensors or motors, drawn for each; or one for each of them, in their order."""


@dataclass(frozen=True, slots=True)
class Gap:
    """Sensor and motor imperfections of one body.

    The controller sees ``gain * s + offset + noise * N(0, 1)`` of a sensor value s in 0..1. The body gets,
    `latency_steps` later, ``neutral + gain * (m - neutral)`` of a motor value m, or neutral inside the dead band.

    Attributes:
        sensor_offset: added to each sensor, in units of full scale; drawn per sensor.
        sensor_gain: factor on each sensor; drawn per sensor.
        sensor_noise: standard deviation of noise at each step, in units of full scale; one for all sensors.
        motor_gain: factor on each motor's distance from neutral; drawn per motor.
        motor_dead_band: distance from neutral, in units of full scale, below which a motor does not move.
        latency_steps: control steps between a motor value and its effect, 0..`MAX_LATENCY_STEPS`, rounded.
        robot_number: None draws anew for every trial; a number draws once, for the robot of this number. Noise at each
            step is a trial's own in either case.
    """

    sensor_offset: Spreads = Spread(0.0)
    sensor_gain: Spreads = Spread(1.0)
    sensor_noise: Spread = Spread(0.0)
    motor_gain: Spreads = Spread(1.0)
    motor_dead_band: Spread = Spread(0.0)
    latency_steps: Spread = Spread(0.0)
    robot_number: int | None = None

    @property
    def is_none(self) -> bool:
        """True for the paper's perfect body."""
        return replace(self, robot_number=None) == Gap()

    def of_robot(self, number: int) -> Gap:
        """The gap of one robot, the same in all its trials; a gap that is one robot's already is kept."""
        return replace(self, robot_number=number) if self.robot_number is None else self

    def draw(
        self, trial_keys: NDArray[np.uint64], n_sensors: int, n_motors: int, neutral: float
    ) -> NDArray[np.float32]:
        """The gap of each trial, from its noise key alone; of a robot, from its number alone.

        Returns:
            Shape ``(n, GAP_FIXED + 2 n_sensors + n_motors)``: the fixed rows, sensor offsets, sensor gains, motor
            gains; shape ``(0, 0)`` if there is no gap.

        Raises:
            ValueError: values for another number of sensors or motors.
        """
        if self.is_none:
            return np.zeros((0, 0), np.float32)
        if self.robot_number is not None:
            one = replace(self, robot_number=None).draw(
                keys(self.robot_number, Purpose.ROBOT), n_sensors, n_motors, neutral
            )
            return np.repeat(one, len(trial_keys), axis=0)
        columns = [self.sensor_noise, self.motor_dead_band, self.latency_steps]
        columns += each("sensor_offset", self.sensor_offset, n_sensors, "sensors")
        columns += each("sensor_gain", self.sensor_gain, n_sensors, "sensors")
        columns += each("motor_gain", self.motor_gain, n_motors, "motors")
        uniform = uniforms(trial_keys, 3 * len(columns)).reshape(len(trial_keys), 3, len(columns))
        normal = np.sqrt(-2.0 * np.log1p(-uniform[:, 1])) * np.cos(2.0 * np.pi * uniform[:, 2])
        drawn = np.stack([spread.draw(uniform[:, 0, c], normal[:, c]) for c, spread in enumerate(columns)], axis=1)
        drawn[:, 0:2] = np.maximum(drawn[:, 0:2], 0.0)
        drawn[:, 2] = np.clip(np.rint(drawn[:, 2]), 0, MAX_LATENCY_STEPS)
        return np.insert(drawn, GAP_FIXED - 1, neutral, axis=1).astype(np.float32)


def each(name: str, spreads: Spreads, count: int, things: str) -> Sequence[Spread]:
    """One spread for each sensor or motor.

    Args:
        name: of the quantity, for the message.
        spreads: what the gap says.
        count: how many there are.
        things: what they are, for the message.

    Raises:
        ValueError: there are not as many.
    """
    if isinstance(spreads, Spread):
        return [spreads] * count
    if len(spreads) != count:
        raise ValueError(f"{name}: expected one value, or one for each of {count} {things}, got {len(spreads)} values")
    return spreads


@compiled_part
def apply_sensor_gap(
    sensors: NDArray[np.float32],
    lane_gap: NDArray[np.float32],
    key_low: NDArray[np.uint32],
    key_high: NDArray[np.uint32],
    step: NDArray[np.int32],
) -> None:
    """What the controller sees instead of what is; arrays over lanes, see `Gap` and `Gap.draw`."""
    n = sensors.shape[0]
    for j in range(n):
        for lane in range(LANES):
            offset = lane_gap[GAP_FIXED + j, lane]
            gain = lane_gap[GAP_FIXED + n + j, lane]
            counter = _U(_U(_U(step[lane]) * _U(CHANNELS)) + _U(FIRST_SENSOR_CHANNEL + 2 * j))
            deviate, _ = normal_pair(key_low[lane], key_high[lane], counter)
            sensors[j, lane] = gain * sensors[j, lane] + offset + lane_gap[0, lane] * deviate


@compiled_part
def apply_motor_gap(
    motors: NDArray[np.float32], delayed: NDArray[np.float32], lane_gap: NDArray[np.float32], n_sensors: int
) -> None:
    """What the motors do instead of what they were told; `delayed` keeps the last commands, newest first."""
    n_motors = motors.shape[0]
    for m in range(n_motors):
        for d in range(delayed.shape[0] - 1, 0, -1):
            for lane in range(LANES):
                delayed[d, m, lane] = delayed[d - 1, m, lane]
        for lane in range(LANES):
            delayed[0, m, lane] = motors[m, lane]
        for lane in range(LANES):
            neutral = lane_gap[GAP_FIXED - 1, lane]
            command = delayed[np.uint32(lane_gap[2, lane]), m, lane]
            distance = lane_gap[GAP_FIXED + 2 * n_sensors + m, lane] * (command - neutral)
            motors[m, lane] = neutral if abs(distance) < lane_gap[1, lane] else neutral + distance

"""What a robot's sensors should have read, had it been the simulated body with a certain gap.

The body is driven with the robot's own motor values, open loop, from each trial's start. A body with noise of its own
is driven several times, and the mean is what is expected. Values beyond a sensor's range are expected at its end, as
the robot reads them, so no gap can hide from the comparison by moving every sample out of range.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from backends.simulation.body import SimulatedBody
from backends.simulation.openloop import drive
from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.robot import Trace
from sceann_hil.seeds import Purpose, keys

WINDOW_STEPS = 40
"""Steps of a trial that are used: later on an unstable body has forgotten its start."""
MOST_TRIALS = 30
_COPIES = 24
"""Times that a body with noise of its own is driven through each trial."""
_FAR = 1e3
"""A sensor value that is beyond every range, in place of infinity."""
_SMALLEST_NOISE = 1e-4

Float = NDArray[np.float64]


@dataclass(frozen=True)
class Observed:
    """The different trials of a robot, cut to their first steps (n trials, s steps).

    Attributes:
        starts: start values, shape ``(n, n_start)``.
        sensors: what it read, full scale 1, shape ``(n, s, n_sensors)``.
        known: the trial lasted so long, shape ``(n, s, 1)``.
        motors: what its motors were told, 0..1, shape ``(n, s, n_motors)``.
    """

    starts: Float
    sensors: Float
    known: NDArray[np.bool_]
    motors: Float

    @classmethod
    def of(cls, starts: Float, traces: Sequence[Trace], n_motors: int) -> Observed:
        """Of the longest trials: one that ended at once tells nothing of latency, and one that was the same again
        tells nothing more.

        Raises:
            ValueError: there is no trace of more than 2 steps.
        """
        different = {}
        for start, trace in zip(starts, traces, strict=True):
            steps = min(WINDOW_STEPS, len(trace.sensors))
            if steps > 2:
                different[start.tobytes(), trace.sensors[:steps].tobytes(), trace.x[:steps].tobytes()] = start, trace
        used = sorted(different.values(), key=lambda pair: -len(pair[1].sensors))[:MOST_TRIALS]
        if not used:
            raise ValueError("traces: expected at least one of more than 2 steps")
        n, longest = len(used), min(WINDOW_STEPS, len(used[0][1].sensors))
        sensors = np.zeros((n, longest, used[0][1].sensors.shape[1]))
        motors = np.zeros((n, longest, n_motors))
        known = np.zeros((n, longest, 1), np.bool_)
        for i, (_, trace) in enumerate(used):
            steps = min(longest, len(trace.sensors))
            sensors[i, :steps] = trace.sensors[:steps] / SENSOR_MAX
            motors[i, :steps] = trace.x[:steps, -n_motors:] / ONE
            known[i, :steps] = True
        return cls(np.stack([start for start, _ in used]), sensors, known, motors)

    @cached_property
    def in_range(self) -> NDArray[np.bool_]:
        """Samples that are at neither end of their sensor's range, shape ``(n, s, n_sensors)``."""
        return self.known & (self.sensors > 0.0) & (self.sensors < 1.0)


@dataclass(frozen=True)
class Parameters:
    """A gap as the estimate varies it, without its noise.

    Attributes:
        offset: of each sensor.
        gain: of each sensor.
        motor_gain: of each motor.
        latency: control steps.
    """

    offset: Float
    gain: Float
    motor_gain: Float
    latency: int

    @classmethod
    def none(cls, n_sensors: int, n_motors: int) -> Parameters:
        """No gap."""
        return cls(np.zeros(n_sensors), np.ones(n_sensors), np.ones(n_motors), 0)

    @property
    def vector(self) -> Float:
        """All but the latency, in the order of the attributes."""
        return np.concatenate([self.offset, self.gain, self.motor_gain])

    def moved_to(self, vector: Float) -> Parameters:
        """The same latency with other numbers."""
        n = len(self.offset)
        return Parameters(vector[:n], vector[n : 2 * n], np.clip(vector[2 * n :], 0.05, 3.0), self.latency)


class GapModel:
    """Expected sensor values of the observed trials.

    Args:
        robot: the simulated body; its own gap is left out.
        observed: the trials.
        copies: times that each is driven.
    """

    def __init__(self, robot: SimulatedBody, observed: Observed, copies: int = _COPIES) -> None:
        self.robot = robot
        self.observed = observed
        self.copies = copies if robot.n_noise else 1
        n = len(observed.starts)
        self._keys = keys(0, Purpose.TRIAL, np.arange(n)[:, None], np.arange(self.copies))
        self._last: tuple[tuple[float, ...], int, Float] | None = None

    def sensed(self, parameters: Parameters) -> Float:
        """Of each copy, before offset, gain and range, shape ``(n, copies, s, n_sensors)``."""
        which = tuple(parameters.motor_gain.tolist()), parameters.latency
        if self._last is not None and self._last[:2] == which:
            return self._last[2]
        motors, neutral, latency = self.observed.motors, self.robot.neutral_motor, parameters.latency
        delayed = np.full_like(motors, neutral)
        delayed[:, latency:] = motors[:, : motors.shape[1] - latency]
        moved = neutral + parameters.motor_gain * (delayed - neutral)
        n, steps, _ = motors.shape
        commands = np.repeat(moved.astype(np.float32), self.copies, axis=0)
        starts = np.repeat(self.observed.starts, self.copies, axis=0)
        raw = drive(self.robot, starts, commands, self._keys.ravel()).astype(np.float64)
        shaped = np.nan_to_num(raw, nan=0.0, posinf=_FAR, neginf=-_FAR).reshape(n, self.copies, steps, -1)
        self._last = *which, shaped
        return shaped

    def expected(self, parameters: Parameters, noise: float) -> Float:
        """Mean of each copy's sensor values in their range 0..1, in the shape of `sensed`.

        Sensor noise moves the mean of a value near the end of its range: this is the mean of a normal distribution
        censored at 0 and 1.
        """
        mean = parameters.gain * self.sensed(parameters) + parameters.offset
        deviation = max(noise, _SMALLEST_NOISE)
        low, high = -mean / deviation, (1.0 - mean) / deviation
        below, above = ndtr(low), ndtr(high)
        return np.asarray(mean * (above - below) + deviation * (_density(low) - _density(high)) + 1.0 - above)

    def residual(self, parameters: Parameters, noise: float) -> Float:
        """Observed minus expected, 0 where a trial was over, shape ``(n, s, n_sensors)``."""
        left = self.observed.sensors - self.expected(parameters, noise).mean(axis=1)
        return np.where(self.observed.known, left, 0.0)

    def jacobian(self, parameters: Parameters, noise: float) -> Float:
        """Derivative of the residual by `Parameters.vector`, shape ``(n, s, n_sensors, n_parameters)``."""
        sensed, known = self.sensed(parameters), self.observed.known
        mean = parameters.gain * sensed + parameters.offset
        deviation = max(noise, _SMALLEST_NOISE)
        slope = ndtr((1.0 - mean) / deviation) - ndtr(-mean / deviation)
        n_sensors = sensed.shape[-1]
        columns = np.zeros((*self.observed.sensors.shape, len(parameters.vector)))
        by_offset, by_gain = slope.mean(axis=1), (slope * sensed).mean(axis=1)
        for j in range(n_sensors):
            columns[..., j, j] = np.where(known[..., 0], -by_offset[..., j], 0.0)
            columns[..., j, n_sensors + j] = np.where(known[..., 0], -by_gain[..., j], 0.0)
        # wide steps over a mean of few noisy copies, which is rough from near
        step = 0.02 if self.copies > 1 else 0.002
        for k in range(2 * n_sensors, len(parameters.vector)):
            aside = np.zeros(len(parameters.vector))
            aside[k] = step
            up, down = (parameters.moved_to(parameters.vector + sign * aside) for sign in (1.0, -1.0))
            columns[..., k] = (self.residual(up, noise) - self.residual(down, noise)) / (2.0 * step)
        return columns


def _density(x: Float) -> Float:
    return np.asarray(np.exp(-0.5 * x * x) / np.sqrt(2.0 * np.pi))

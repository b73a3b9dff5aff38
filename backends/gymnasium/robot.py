"""An environment stepped by a controller; its reward adds up to the trial's value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from backends.gymnasium.environment import Option, make
from sceann_hil.robot import EndReason, Results, RobotSpec, Trials
from sceann_hil.robot.stepped import SteppedRobot


@dataclass(frozen=True, slots=True)
class Wiring:
    """What of the environment is which sensor and motor.

    Attributes:
        observation: number of the observation that each sensor reads, shape ``(n_sensors,)``.
        sensor_scales: what reads 0 and what reads 1, shape ``(n_sensors, 2)``.
        n_actions: choices of a discrete action; 0 for numbers.
        motor_scales: the action's numbers at motor values 0 and 1, shape ``(n_motors, 2)``.
        terminated, truncated: what these ends of an episode mean.
    """

    observation: NDArray[np.int64]
    sensor_scales: NDArray[np.float64]
    n_actions: int
    motor_scales: NDArray[np.float64]
    terminated: EndReason
    truncated: EndReason


class GymnasiumRobot(SteppedRobot):
    """A Gymnasium environment; each trial is an episode that begins with the seed of its start.

    Its results carry the sum of the rewards as their values, unless the task adds up something of its own.

    Args:
        spec: what it is.
        env: the environment's id.
        options: for ``gymnasium.make``.
        wiring: see `Wiring`.
    """

    paced = False

    def __init__(self, spec: RobotSpec, env: str, options: Mapping[str, Option], wiring: Wiring) -> None:
        super().__init__()
        self._spec = spec
        self._env_id, self._options = env, dict(options)
        self._env: Any = None
        self._which = wiring.observation
        low, high = wiring.sensor_scales.T
        self._per_unit, self._offset = 1.0 / (high - low), -low / (high - low)
        self._sees_all = np.array_equal(self._which, np.arange(len(spec.state_fields)))
        self._n_actions = wiring.n_actions
        self._rest, self._span = wiring.motor_scales[:, 0], wiring.motor_scales[:, 1] - wiring.motor_scales[:, 0]
        self._meaning = (wiring.terminated, wiring.truncated)
        self._observed: NDArray[np.floating[Any]] = np.zeros(len(spec.state_fields))
        self._returns: list[float] = []
        self._end: EndReason | None = None

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    def connect(self) -> None:
        """Make the environment; does nothing if it is there."""
        if self._env is None:
            self._env = make(self._env_id, self._options)

    def disconnect(self) -> None:
        if self._env is not None:
            self._env.close()
            self._env = None

    def run(self, trials: Trials) -> Results:
        """Run the trials as episodes, one after the other."""
        self.connect()
        self._returns = []
        results = super().run(trials)
        if trials.accumulation is not None or len(self._returns) != len(trials):
            return results
        return replace(results, values=np.array(self._returns))

    def trace(self, trials: Trials) -> Results:
        return self.run(trials)

    def reset(self, start: dict[str, float], key: int) -> None:
        self._observed, _ = self._env.reset(seed=int(start["seed"]))
        self._returns.append(0.0)
        self._end = None

    def sense(self) -> NDArray[np.float64]:
        seen = self._observed if self._sees_all else self._observed[self._which]
        values: NDArray[np.float64] = seen * self._per_unit + self._offset
        return values

    def state(self) -> NDArray[np.floating[Any]]:
        return self._observed

    def drive(self, motors: NDArray[np.float64]) -> None:
        action: Any
        if self._n_actions:
            action = min(int(motors.item(0) * self._n_actions), self._n_actions - 1)
        else:
            action = (self._rest + self._span * motors).astype(np.float32)
        self._observed, reward, terminated, truncated, _ = self._env.step(action)
        self._returns[-1] += float(reward)
        if terminated or truncated:
            self._end = self._meaning[0] if terminated else self._meaning[1]

    def ended(self) -> EndReason | None:
        return self._end

    def stop(self) -> None:
        """Nothing moves between the steps of an environment."""

"""Our simulated robots and tasks as Gymnasium environments, so that other methods can be compared with evolution.

::

    from backends.gymnasium.ours import SceannEnv
    env = SceannEnv(sh.config(task="pole_balancing", robot="cartpole", ...))
"""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from backends.simulation.body import SimulatedBody
from backends.simulation.stepwise import StepwiseBody
from sceann_hil.config import ExperimentConfig
from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.robot import EndReason, Results
from sceann_hil.robot.accumulation import Combine


class SceannEnv(gymnasium.Env[NDArray[np.float32], NDArray[np.float32]]):
    """One trial is one episode; the controller's sensors are the observation, its motors the action, both 0..1.

    The rewards of an episode add up to the trial's fitness: a task that adds up its steps gives each step's part, any
    other task gives the whole fitness with the last step. `reset` takes ``options={"trial": k}`` for one of the task's
    trials; without it the trial is drawn.

    Args:
        config: a simulated robot and its task; controller and algorithm are not used.
    """

    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(self, config: ExperimentConfig) -> None:
        robot = config.robot.build()
        if not isinstance(robot, SimulatedBody):
            raise ValueError(f"robot: expected a simulated body, got {config.robot.type}")
        self._task, self._spec_of_robot = config.build_task(), robot.spec
        self._task.check_robot(robot.spec)
        self._body = StepwiseBody(robot)
        n_sensors, n_motors = robot.spec.n_sensors, robot.spec.n_motors
        self.observation_space = gymnasium.spaces.Box(0.0, 1.0, (n_sensors,), np.float32)
        self.action_space = gymnasium.spaces.Box(0.0, 1.0, (n_motors,), np.float32)
        self._steps = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Put the body at the start of a trial."""
        super().reset(seed=seed)
        trial = (options or {}).get("trial")
        if trial is None:
            trial = int(self.np_random.integers(self._task.n_trials))
        if not 0 <= trial < self._task.n_trials:
            raise ValueError(f"options: expected trial 0..{self._task.n_trials - 1}, got {trial}")
        key = np.uint64(self.np_random.integers(2**63))
        self._body.reset(self._task.starts_of(np.array([trial]), np.array([key]))[0], key)
        self._steps = 0
        return self._observe(), {"trial": trial}

    def step(self, action: NDArray[np.float32]) -> tuple[NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """One control step with these motor values."""
        motors = np.rint(np.clip(action, 0.0, 1.0) * ONE).astype(int)
        seen, state = self._body.sense().copy(), self._body.state.copy()
        end = self._body.move(motors.tolist())
        self._steps += 1
        time_is_up = end is None and self._steps >= self._task.max_steps
        reward = self._reward(seen, motors / ONE, state, EndReason.TIME_UP if time_is_up else end)
        info = {"end_reason": str(end)} if end is not None else {}
        return self._observe(), reward, end is not None, time_is_up, info

    def _observe(self) -> NDArray[np.float32]:
        return (self._body.sense() / SENSOR_MAX).astype(np.float32)

    def _reward(
        self, seen: NDArray[np.uint16], motors: NDArray[np.float64], state: NDArray[np.float32], end: EndReason | None
    ) -> float:
        accumulation = self._task.accumulation
        if accumulation is not None and accumulation.combine in (Combine.MEAN, Combine.MEAN_OF_ALL, Combine.SUM):
            return float(accumulation.value(seen / SENSOR_MAX, motors, state.astype(np.float64)))
        if end is None:
            return 0.0
        spec = self._spec_of_robot
        results = Results(
            end_reasons=np.array([end], np.uint8),
            steps=np.array([self._steps], np.int32),
            hashes=np.zeros(1, np.uint16),
            final_states=self._body.state[None].copy(),
            durations_s=np.array([self._steps * spec.tick_s]),
        )
        return float(self._task.fitness(results)[0])

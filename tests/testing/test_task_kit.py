"""Every shipped task passes the kit, and the kit finds what is wrong with others."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from backends.cartpole import CartPoleConfig
from backends.diffdrive import DifferentialDriveConfig
from sceann_hil.plugins import RobotConfig, TaskConfig
from sceann_hil.robot import Results
from sceann_hil.robot.task import Task
from sceann_hil.tasks.goal_reach import GoalReachConfig
from sceann_hil.tasks.pole_balancing import PoleBalancing, PoleBalancingConfig
from sceann_hil.testing import TaskConformance


class TestGoalReach(TaskConformance):
    def config(self) -> TaskConfig:
        return GoalReachConfig(max_steps=80)

    def robot(self) -> RobotConfig:
        return DifferentialDriveConfig(n_sensors=3)


class TestPoleBalancing(TaskConformance):
    def config(self) -> TaskConfig:
        return PoleBalancingConfig(max_steps=200)

    def robot(self) -> RobotConfig:
        return CartPoleConfig()


class _Relative(PoleBalancing):
    """Worth more the better it is than the others."""

    def fitness(self, results: Results) -> NDArray[np.float64]:
        return super().fitness(results) / max(results.steps.max(), 1)


class _OfTheTrace(PoleBalancing):
    """Needs what no journal keeps."""

    def fitness(self, results: Results) -> NDArray[np.float64]:
        return np.array([float(trace.sensors.mean() / 1024.0) for trace in results.traces or ()])


class _TooMuch(PoleBalancing):
    def fitness(self, results: Results) -> NDArray[np.float64]:
        return 1000.0 + super().fitness(results)


class _Config(TaskConfig):
    type: Literal["broken"] = "broken"
    kind: Any = None

    def build(self) -> Task:
        task: Task = self.kind(PoleBalancingConfig(max_steps=100, start_angle_deg=1.0))
        return task


class _Broken(TaskConformance):
    kind: Any

    def config(self) -> TaskConfig:
        return _Config(kind=self.kind)

    def robot(self) -> RobotConfig:
        return CartPoleConfig()


@pytest.mark.parametrize(
    ("kind", "test", "message"),
    [
        (_Relative, "test_a_trial_is_worth_the_same_alone", "is worth something else alone"),
        (_OfTheTrace, "test_fitness_is_one_number_within_its_limits_for_each_trial", "expected shape"),
        (_OfTheTrace, "test_a_trial_is_worth_the_same_when_the_journal_tells_of_it", "it needs the traces"),
        (_TooMuch, "test_fitness_is_one_number_within_its_limits_for_each_trial", "expected at most best_fitness 100"),
    ],
)
def test_the_kit_finds_what_is_wrong(kind: Any, test: str, message: str) -> None:
    kit = _Broken()
    kit.kind = kind
    with pytest.raises(AssertionError, match=message):
        getattr(kit, test)()

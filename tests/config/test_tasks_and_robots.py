"""A task and a robot that do not start from the same values are refused before anything runs, whoever wrote them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from backends.cartpole import CartPoleConfig
from backends.diffdrive import DifferentialDriveConfig
from sceann_hil.config import ExperimentConfig, parse_config
from sceann_hil.errors import ConfigError
from sceann_hil.plugins import TaskConfig
from sceann_hil.robot import Results
from sceann_hil.robot.task import Task


class Anywhere(Task):
    """A task whose author thought of nothing."""

    name = "anywhere"
    max_steps = 10
    start_fields = ("x_m", "y_m")
    best_fitness = 1.0
    given: Any = np.zeros((1, 2))

    @property
    def starts(self) -> NDArray[np.float64]:
        return self.given  # type: ignore[no-any-return]

    def fitness(self, results: Results) -> NDArray[np.float64]:
        return np.ones(len(results))

    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        return np.ones(len(results), np.bool_)


class AnywhereConfig(TaskConfig):
    type: Literal["anywhere"] = "anywhere"

    def build(self) -> Task:
        return Anywhere()


def test_a_configuration_is_refused() -> None:
    whole = parse_config(
        "task: {type: pole_balancing}\nrobot: {type: cartpole}\n"
        "controller: {coding: sceann3, n_hidden: 1}\nalgorithm: {type: sga}\n",
        "test",
    )
    sections = {name: getattr(whole, name) for name in ("controller", "algorithm")}
    for robot in (CartPoleConfig(), DifferentialDriveConfig(n_sensors=2)):
        with pytest.raises(ValidationError, match="the task anywhere starts its trials from x_m, y_m, but the robot"):
            ExperimentConfig(task=AnywhereConfig(), robot=robot, **sections)


def test_so_are_the_shipped_ones() -> None:
    with pytest.raises(ConfigError, match=r"task\.type.*goal_reach starts its trials from x_m, y_m, heading_rad"):
        parse_config(
            "task: {type: goal_reach}\nrobot: {type: cartpole}\n"
            "controller: {coding: sceann3, n_hidden: 1}\nalgorithm: {type: sga}\n",
            "test",
        )


@pytest.mark.parametrize(
    ("starts", "message"),
    [
        (np.zeros((3, 3)), "expected one row of 2 values"),
        (np.zeros((0, 2)), "expected one row of 2 values"),
        (np.zeros(2), "expected one row of 2 values"),
        (np.array([[0.0, np.inf]]), "expected finite numbers"),
    ],
)
def test_starts_that_are_no_rows_of_numbers_are_refused(starts: Any, message: str) -> None:
    spec = replace(DifferentialDriveConfig().spec, start_fields=("x_m", "y_m"))
    task = Anywhere()
    task.check_robot(spec)
    task.given = starts
    with pytest.raises(ValueError, match=message):
        task.check_robot(spec)


def test_so_is_a_trial_without_steps() -> None:
    spec = replace(DifferentialDriveConfig().spec, start_fields=("x_m", "y_m"))
    task = Anywhere()
    task.max_steps = 0
    with pytest.raises(ValueError, match="max_steps of the task anywhere: expected 1"):
        task.check_robot(spec)

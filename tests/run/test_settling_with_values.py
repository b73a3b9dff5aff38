"""A trial whose fitness adds up over its steps is settled after a crash like any other."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from backends.cartpole import CartPole, CartPoleConfig
from sceann_hil.config import ExperimentConfig, parse_config
from sceann_hil.plugins import TaskConfig
from sceann_hil.robot import Results, Trials
from sceann_hil.robot.step_task import StepTask
from sceann_hil.robot.step_value import step_value
from sceann_hil.run.experiment import Experiment
from tests.installed import installed
from tests.runs import POLE, contents

Floats = NDArray[np.float64]


@step_value
def upright(sensors: Floats, motors: Floats, state: Floats) -> float:
    return 1.0 - abs(2.0 * sensors[1] - 1.0) + state[0]  # type: ignore[no-any-return]


class UprightConfig(TaskConfig):
    type: Literal["upright"] = "upright"

    def build(self) -> StepTask:
        fields = CartPoleConfig().spec.start_fields
        starts = [[0.0, 0.0, 0.02, 0.0], [0.0, 0.0, -0.03, 0.0]]
        return StepTask(
            value=upright, max_steps=60, start_fields=fields, starts=starts, succeeded=lambda fitness: fitness > 0.9
        )


class Dies(CartPole):
    """Takes the process with it in the third generation."""

    def __init__(self) -> None:
        super().__init__()
        self.runs = 0

    def run(self, trials: Trials) -> Results:
        self.runs += len(trials) > 0
        if self.runs == 3:
            raise KeyboardInterrupt
        return super().run(trials)


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ExperimentConfig]:
    entries = {"upright": f"[sceann_hil.tasks]\nupright = {__name__}:UprightConfig\n"}
    with installed(tmp_path / "site", entries, monkeypatch):
        yield parse_config(POLE, "test", ("task={type: upright}",))


def test_a_run_that_was_cut_off_is_the_run_that_was_not(config: ExperimentConfig, tmp_path: Path) -> None:
    with Experiment.create(config, tmp_path / "whole") as experiment, config.robot.build() as robot:
        experiment.evolve(robot)
    with (
        pytest.raises(KeyboardInterrupt),
        Experiment.create(config, tmp_path / "cut") as experiment,
        Dies() as robot,
    ):
        experiment.evolve(robot)
    with Experiment.open(tmp_path / "cut") as experiment, config.robot.build() as robot:
        experiment.evolve(robot)
    whole, cut = contents(tmp_path / "whole"), contents(tmp_path / "cut")
    for table in ("generation", "individual", "attempt"):
        assert cut[table] == whole[table]

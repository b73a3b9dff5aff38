"""Trials that tell of one robot tell nothing of another: a swapped robot is noticed."""

from __future__ import annotations

from pathlib import Path

import pytest

from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.run.experiment import Experiment, Outcome, StopRequest
from sceann_hil.run.rehearsal import StandIn
from sceann_hil.supervision.operators import Desk


class Named(StandIn):
    """A robot that knows who it is."""

    name = "a"

    @property
    def identity(self) -> str:
        return self.name


def session(config: ExperimentConfig, directory: Path, who: str) -> Outcome:
    robot = Named(config.robot.build(), attended=False, deterministic=True)
    robot.name = who
    done = 0

    def count(_: object) -> None:
        nonlocal done
        done += 1

    def stop() -> StopRequest:
        return StopRequest.AFTER_GENERATION if done >= 2 else StopRequest.NONE

    with (
        Experiment.open(directory) if directory.exists() else Experiment.create(config, directory) as experiment,
        robot,
    ):
        return experiment.evolve(robot, count, stop, Desk(asks=False))


def test_another_robot_is_refused_and_the_first_one_goes_on(small: ExperimentConfig, tmp_path: Path) -> None:
    assert session(small, tmp_path / "run", "a") is Outcome.STOPPED_AFTER_GENERATION
    with pytest.raises(ConfigError, match=r"another robot \(id b\) than the one that did this run's trials \(id a\)"):
        session(small, tmp_path / "run", "b")
    assert session(small, tmp_path / "run", "a") is Outcome.STOPPED_AFTER_GENERATION

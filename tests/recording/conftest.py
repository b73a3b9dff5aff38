"""Two small finished runs, one of each task, and copies of them that a test may spoil."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from sceann_hil.config import parse_config
from sceann_hil.run.experiment import Experiment

GOAL_REACH = """
name: goal reach
seed: 5
task: {type: goal_reach, max_steps: 90, headings_deg: [0.0, 90.0, 200.0]}
robot: {type: diffdrive, n_sensors: 3}
controller: {coding: sceann2, n_hidden: 2}
algorithm: {type: sga, population: 4, generations: 2}
"""

POLE_BALANCING = """
name: pole balancing
seed: 3
task: {type: pole_balancing, max_steps: 300}
robot: {type: cartpole, n_sensors: 2}
controller: {coding: sceann3, n_hidden: 3}
algorithm: {type: sga, population: 5, generations: 2}
"""


def evolve(text: str, directory: Path) -> Path:
    """A finished run of a configuration."""
    config = parse_config(text, "test")
    with Experiment.create(config, directory) as experiment:
        robot = config.robot.build()
        robot.connect()
        experiment.evolve(robot)
    return directory


@pytest.fixture(scope="session")
def goal_reach(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished goal-reach run without recordings; not to be changed."""
    return evolve(GOAL_REACH, tmp_path_factory.mktemp("goal") / "run")


@pytest.fixture(scope="session")
def pole_balancing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished pole-balancing run without recordings; not to be changed."""
    return evolve(POLE_BALANCING, tmp_path_factory.mktemp("pole") / "run")


@pytest.fixture
def run(goal_reach: Path, tmp_path: Path) -> Path:
    """A goal-reach run of the test's own."""
    return Path(shutil.copytree(goal_reach, tmp_path / "run"))

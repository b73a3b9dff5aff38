"""A run made with packages that are not installed here can be looked at, counted and exported; running it says what
to install."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sceann_hil.cli import app
from sceann_hil.config import journalled_config, noted_config
from sceann_hil.errors import ExitCode, PackageMissing
from sceann_hil.journal import JournalReader
from sceann_hil.recording.process import Detail
from sceann_hil.recording.recorder import Recorder
from sceann_hil.recording.view import GALLERY, OVERVIEW, Screen, prepared
from sceann_hil.versions import running_versions
from tests.installed import installed
from tests.runs import evolve

MODULE = """
from typing import Literal
from backends.cartpole import CartPoleConfig
from sceann_hil.evolution.sga import SGAConfig
from sceann_hil.tasks.pole_balancing import PoleBalancingConfig

class GoneTask(PoleBalancingConfig):
    type: Literal["gone_task"] = "gone_task"

class GoneRobot(CartPoleConfig):
    type: Literal["gone_robot"] = "gone_robot"

class GoneAlgorithm(SGAConfig):
    type: Literal["gone_algorithm"] = "gone_algorithm"
"""
ENTRIES = """
[sceann_hil.tasks]
gone_task = gone_plugins:GoneTask
[sceann_hil.robots]
gone_robot = gone_plugins:GoneRobot
[sceann_hil.algorithms]
gone_algorithm = gone_plugins:GoneAlgorithm
"""
RUN = """
task: {type: gone_task, max_steps: 30}
robot: {type: gone_robot, n_sensors: 2}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: gone_algorithm, population: 4, generations: 1}
"""


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recorded run whose packages have gone since."""
    packages = tmp_path / "packages"
    packages.mkdir()
    (packages / "gone_plugins.py").write_text(MODULE)
    running_versions.cache_clear()
    with installed(packages, {"gone-plugins": ENTRIES}, monkeypatch):
        evolve(tmp_path / "run", RUN)
        recorder = Recorder(tmp_path / "run", Detail.ALL)
        recorder.record()
        recorder.close()
    monkeypatch.undo()
    sys.modules.pop("gone_plugins", None)
    running_versions.cache_clear()
    return tmp_path / "run"


def sceann(*words: str | Path) -> tuple[int, str]:
    done = CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": "200"})
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done.exit_code, done.output


def test_it_is_looked_at_counted_and_exported(run: Path, tmp_path: Path) -> None:
    reader = JournalReader(run)
    config = noted_config(reader)
    assert (config.size.n_sensors, config.size.n_motors, config.robot.spec.name) == (2, 1, "cartpole")
    assert config.robot.model_dump()["n_sensors"] == 2
    reader.close()
    for words in (
        ("status", run),
        ("runs", run),
        ("champion", run),
        ("check", run),
        ("copy", run, "--out", tmp_path / "copy"),
        ("export", run, "-o", tmp_path / "walker.h"),
        ("export-csv", run, "--out", tmp_path / "tables"),
    ):
        code, output = sceann(*words)
        assert code == ExitCode.OK, (words, output)
    assert "sceann3" in (tmp_path / "walker.h").read_text()


def test_its_recordings_are_shown(run: Path) -> None:
    for screen in (GALLERY, OVERVIEW, Screen(trial=2)):
        with prepared(run, screen) as shown:
            assert shown


def test_running_it_names_the_package(run: Path, tmp_path: Path) -> None:
    told = "gone_task', which came with gone-plugins==1.0, is not installed here|gone_robot"
    for words in (("resume", run), ("repeat", run, "-n", "2"), ("replay", run, "1"), ("champion", run, "--robust")):
        with pytest.raises(PackageMissing, match=told) as failed:
            sceann(*words)
        assert failed.value.hint == "Install it: pip install gone-plugins==1.0"
        assert failed.value.exit_code == ExitCode.PACKAGE_MISSING
    (run / "recording" / "run.rrd").unlink()
    with pytest.raises(PackageMissing), prepared(run, OVERVIEW):
        pass
    reader = JournalReader(run)
    with pytest.raises(PackageMissing):
        journalled_config(reader)
    reader.close()

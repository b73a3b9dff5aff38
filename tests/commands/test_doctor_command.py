"""``sceann doctor --move``: what moves the robot is in a journal, and a run at work is left alone."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from backends.cartpole import CartPole
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.cli import app
from sceann_hil.errors import RunIsLocked
from sceann_hil.journal import AttemptKind, JournalReader
from sceann_hil.run.experiment import Experiment
from tests.backends.remote.trials import pole_run, real_robot


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A configuration of a virtual robot, in the folder where one works."""
    monkeypatch.chdir(tmp_path)
    with VirtualPosix(VirtualBody(CartPole())) as virtual:
        path = tmp_path / "cart.yaml"
        path.write_text(pole_run(real_robot(virtual, virtual.port)))
        yield path


def test_movements_are_kept_in_a_folder_of_their_own(robot: Path) -> None:
    result = CliRunner().invoke(app, ["doctor", "--robot", str(robot), "--move", "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["journal"] == "runs/doctor-cart"
    reader = JournalReader(robot.parent / found["journal"])
    assert [row.kind for row in reader.measurements()] == ["doctor"]
    assert [row.fitness for row in reader.attempts_of_kind(AttemptKind.MEASUREMENT)] == [1.0]


def test_a_robot_that_is_not_there_leaves_no_folder_behind(robot: Path) -> None:
    robot.write_text(robot.read_text().replace("port: ", "port: /nowhere"))
    result = CliRunner().invoke(app, ["doctor", "--robot", str(robot), "--move"])
    assert result.exit_code == 1
    assert not (robot.parent / "runs" / "doctor-cart").exists()


def test_a_run_at_work_is_not_disturbed(robot: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("backends.remote.robot.RemoteRobot.connect", lambda _: pytest.fail("the robot was touched"))
    from sceann_hil.config import load_config

    with Experiment.create(load_config(robot), tmp_path / "run"):
        result = CliRunner().invoke(app, ["doctor", "--robot", str(robot), "--move", "--out", str(tmp_path / "run")])
    assert isinstance(result.exception, RunIsLocked)


def test_a_journal_without_movements_is_refused(robot: Path) -> None:
    result = CliRunner().invoke(app, ["doctor", "--robot", str(robot), "--out", "x"])
    assert result.exit_code == 2

"""Measurements outside a run that end early, meet voids, or follow one another on a robot with a memory."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from backends.cartpole import CartPole
from backends.remote import RemoteRobot
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.cli import app
from sceann_hil.commands import measured as command
from sceann_hil.errors import ExitCode, RobotWasStopped
from sceann_hil.robot import EmergencyStop, EndReason, Results, Trials
from sceann_hil.study.gap import Measured, measure
from tests.backends.remote.trials import pole_run, real_robot
from tests.runs import config_of, evolve


@pytest.fixture
def virtual() -> Iterator[VirtualPosix]:
    with VirtualPosix(VirtualBody(CartPole(n_sensors=2))) as robot:
        yield robot


@pytest.fixture
def run(tmp_path: Path) -> Path:
    evolve(tmp_path / "run", pole_run("{type: cartpole, n_sensors: 2}", population=4, generations=0, max_steps=10))
    return tmp_path / "run"


def test_a_void_trial_is_run_again_and_a_second_measurement_is_not_the_first(virtual: VirtualPosix) -> None:
    """The robot refuses the number that it ran last: a repeat under the same number can only be void again."""
    config = config_of(pole_run(real_robot(virtual, virtual.port), max_steps=10))
    phenotype = config.phenotype
    genomes = np.random.default_rng(4).integers(0, 2, (1, config.genome_length), dtype=np.uint8)
    told: list[Measured] = []
    with config.robot.build() as robot:
        assert isinstance(robot, RemoteRobot)
        runs: list[int] = []
        run = robot.run

        def void_at_first(trials: Trials) -> Results:
            results = run(trials)
            runs.append(int(trials.ids[0]))
            return Results.void(1, EndReason.LINK_LOST, 4) if len(runs) == 1 else results

        robot.run = void_at_first  # type: ignore[method-assign]
        for _ in range(2):
            measure(robot, phenotype, config.task.build(), genomes, 1, 1, report=told.append)
    assert len(runs) >= 3
    assert len(set(runs)) == len(runs)
    assert [(one.genome, one.repeat, one.trial) for one in told] == [(0, 0, 0)] * 2


def test_an_operator_ends_a_measurement_without_a_traceback(run: Path, virtual: VirtualPosix, tmp_path: Path) -> None:
    robot = real_robot(virtual, virtual.port).replace("rig:", "attended: true, rig:")
    (tmp_path / "real.yaml").write_text(f"robot: {robot}\n")
    # a script that has nothing to say ends the run in good order
    result = CliRunner().invoke(
        app, ["repeat", str(run), "-n", "2", "--on", str(tmp_path / "real.yaml"), "--operator", "script"]
    )
    assert result.exit_code == ExitCode.OPERATOR_FINISHED, result.output
    assert "trials.csv" in result.output


@pytest.mark.parametrize(
    ("error", "code"), [(KeyboardInterrupt(), ExitCode.INTERRUPTED_NOW), (EmergencyStop("x"), None)]
)
def test_what_was_measured_before_the_end_is_kept(
    run: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException, code: ExitCode | None
) -> None:
    def half(*arguments: object) -> None:
        report = arguments[-1]
        assert callable(report)
        report(Measured(0, 0, 0, 7.0, 7, EndReason.FELL, 0.14))
        raise error

    monkeypatch.setattr(command, "measure", half)
    for _ in range(2):
        result = CliRunner().invoke(app, ["repeat", str(run), "-n", "2"])
        if code is None:
            assert isinstance(result.exception, RobotWasStopped)
            assert "resume" not in result.exception.hint
        else:
            assert result.exit_code == code
    with (run / "reports" / "repeat" / "trials.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [(row["fitness"], row["end_reason"]) for row in rows] == [("7.0", "fell")] * 2


def test_a_place_that_cannot_be_written_to_costs_no_robot_time(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "measure", lambda *_: pytest.fail("the robot moved"))
    (run / "reports").write_text("a file where a folder is needed")
    for arguments in (["repeat", str(run)], ["compare", str(run), "--on", str(run / "config.yaml")]):
        assert isinstance(CliRunner().invoke(app, arguments).exception, OSError)

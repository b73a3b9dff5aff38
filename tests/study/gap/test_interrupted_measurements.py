"""compare and repeat on a robot: lock, people, limits and journal hold; what was interrupted goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from backends.cartpole import CartPole
from backends.remote import RemoteRobot
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.cli import app
from sceann_hil.errors import CannotWrite, ExitCode, RobotIsFaulty, RunIsLocked
from sceann_hil.journal import AttemptKind, AttemptRow, JournalReader
from sceann_hil.robot import EndReason, Results, RobotFault, Trials
from sceann_hil.run.experiment import Experiment
from tests.backends.remote.trials import pole_run, real_robot
from tests.runs import config_of, evolve, measure_on

N = 3
"""Repeats of the one trial that these runs have."""


@pytest.fixture
def virtual() -> Iterator[VirtualPosix]:
    with VirtualPosix(VirtualBody(CartPole())) as robot:
        yield robot


@pytest.fixture
def run(tmp_path: Path) -> Path:
    evolve(tmp_path / "run", pole_run("{type: cartpole, n_sensors: 2}", population=4, generations=0, max_steps=10))
    return tmp_path / "run"


@pytest.fixture
def repeat(run: Path, virtual: VirtualPosix, tmp_path: Path) -> Callable[..., Any]:
    """`sceann repeat` on the virtual robot."""
    (tmp_path / "real.yaml").write_text(f"robot: {real_robot(virtual, virtual.port)}\n")

    def invoke(*arguments: str) -> Any:
        return CliRunner().invoke(app, ["repeat", str(run), "-n", str(N), "--on", f"{tmp_path}/real.yaml", *arguments])

    return invoke


def measured(run: Path) -> list[AttemptRow]:
    reader = JournalReader(run)
    try:
        return reader.attempts_of_kind(AttemptKind.MEASUREMENT)
    finally:
        reader.close()


def test_every_trial_is_in_the_journal_of_the_run_and_not_in_its_evolution(repeat: Any, run: Path) -> None:
    assert repeat().exit_code == 0
    rows = measured(run)
    assert [(row.individual, row.trial, row.attempt) for row in rows] == [(r, 0, 0) for r in range(N)]
    assert len({row.genome for row in rows}) == 1
    assert all(row.fitness is not None and row.generation is None for row in rows)
    reader = JournalReader(run)
    assert len(reader.attempts(0)) == 4
    assert [(row.kind, row.finished_at is None) for row in reader.measurements()] == [("repeat", False)]
    assert reader.spent("remote (onboard)").trials == N
    assert reader.spent().trials == N + 4


def test_what_was_interrupted_goes_on_where_it_was_and_what_was_finished_begins_anew(repeat: Any, run: Path) -> None:
    first = repeat("--budget-trials", "2")
    assert first.exit_code == ExitCode.BUDGET_SPENT, first.output
    assert "The budget of trials is used up: 2 of 2. What was measured is kept" in first.output
    second = repeat("--budget-trials", "100")
    assert second.exit_code == 0, second.output
    assert "2 of 3 trials were measured before" in second.output
    assert len(measured(run)) == N
    assert repeat("--budget-trials", "100").exit_code == 0
    assert len(measured(run)) == 2 * N
    assert {row.measurement for row in measured(run)} == {1, 2}


def test_nobody_else_works_on_the_run_meanwhile(repeat: Any, run: Path) -> None:
    with Experiment.open(run):
        assert isinstance(repeat().exception, RunIsLocked)
    assert measured(run) == []


def test_a_fault_ends_it_and_the_same_command_goes_on(repeat: Any, run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    original, calls = RemoteRobot.run, iter(range(100))

    def failing(self: RemoteRobot, trials: Trials) -> Results:
        if next(calls) == 1:
            raise RobotFault("the wheel is off")
        return original(self, trials)

    monkeypatch.setattr(RemoteRobot, "run", failing)
    error = repeat().exception
    assert isinstance(error, RobotIsFaulty)
    assert "the same command again" in error.hint
    # begun and never ended: the robot is asked how it ended
    assert [row.end_reason is None for row in measured(run)] == [False, True]
    assert repeat().exit_code == 0
    assert sum(row.fitness is not None for row in measured(run)) == N


def test_an_operator_ends_a_measurement_without_a_traceback(run: Path, virtual: VirtualPosix, tmp_path: Path) -> None:
    robot = real_robot(virtual, virtual.port).replace("rig:", "attended: true, rig:")
    (tmp_path / "real.yaml").write_text(f"robot: {robot}\n")
    # a script that has nothing to say ends the run in good order
    result = CliRunner().invoke(
        app, ["repeat", str(run), "-n", "2", "--on", str(tmp_path / "real.yaml"), "--operator", "script"]
    )
    assert result.exit_code == ExitCode.OPERATOR_FINISHED, result.output
    assert "What was measured is kept" in result.output


def test_a_person_gives_the_verdict_where_that_is_wanted(virtual: VirtualPosix, tmp_path: Path) -> None:
    """Regression: compare and repeat never asked whether a trial counts."""
    robot = real_robot(virtual, virtual.port).replace("rig:", "attended: true, rig:")
    script = "operator={who: [script], script: [ready, discard it slipped, ready, accept, ready, accept]}"
    evolve(
        tmp_path / "run", pole_run("{type: cartpole, n_sensors: 2}", population=4, generations=0, max_steps=10), script
    )
    (tmp_path / "real.yaml").write_text(f"robot: {robot}\n")
    result = CliRunner().invoke(app, ["repeat", str(tmp_path / "run"), "-n", "2", "--on", str(tmp_path / "real.yaml")])
    assert result.exit_code == 0, result.output
    assert [(row.individual, row.fitness is None, row.note) for row in measured(tmp_path / "run")] == [
        (0, True, "discard: it slipped"),
        (1, False, None),
        (0, False, None),
    ]


def test_a_void_trial_is_run_again_and_a_second_measurement_is_not_the_first(
    virtual: VirtualPosix, tmp_path: Path
) -> None:
    """The robot refuses the number that it ran last: a repeat under the same number can only be void again."""
    config = config_of(pole_run(real_robot(virtual, virtual.port), max_steps=10))
    genomes = np.random.default_rng(4).integers(0, 2, (1, config.genome_length), dtype=np.uint8)
    with config.robot.build() as robot:
        assert isinstance(robot, RemoteRobot)
        runs: list[int] = []
        run = robot.run

        def void_at_first(trials: Trials) -> Results:
            results = run(trials)
            runs.append(int(trials.ids[0]))
            return Results.void(1, EndReason.LINK_LOST, 4, "lost") if len(runs) == 1 else results

        robot.run = void_at_first  # type: ignore[method-assign]
        for _ in range(2):
            assert measure_on(tmp_path / "run", config, robot, genomes).fitness.shape == (1, 1, 1)
    assert len(runs) == 3
    assert len(set(runs)) == len(runs)
    assert [row.note for row in measured(tmp_path / "run")] == ["lost", None, None]


def test_a_place_that_cannot_be_written_to_costs_no_robot_time(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sceann_hil.commands.gap.measure", lambda *_: pytest.fail("the robot moved"))
    (run / "reports").write_text("a file where a folder is needed")
    for arguments in (["repeat", str(run)], ["compare", str(run), "--on", str(run / "config.yaml")]):
        assert isinstance(CliRunner().invoke(app, arguments).exception, CannotWrite)

"""Budgets: checked before a trial, never cutting one, the same over all sessions of a run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from sceann_hil.journal import JournalReader
from sceann_hil.robot import Robot
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.run.rehearsal import rehearsal
from sceann_hil.supervision.budget import Amounts, Meter
from sceann_hil.timespans import parse_duration_s
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside

INFINITE = Amounts.unlimited()


def one_by_one(directory: Path, *overrides: str, more: dict[str, float] | None = None) -> Outcome:
    """A run on a robot that takes one trial at a time; or the rest of it."""
    config = config_of(GOAL, *overrides)
    robot: Robot = Beside(config.robot.build())
    exists = directory.exists()
    with Experiment.open(directory) if exists else Experiment.create(config, directory) as experiment, robot:
        return experiment.evolve(robot, more=more)


def test_a_budget_of_trials_is_kept_to_the_trial_and_can_be_extended(tmp_path: Path) -> None:
    assert one_by_one(tmp_path / "run", "budget.trials=10") is Outcome.BUDGET_SPENT
    assert JournalReader(tmp_path / "run").spent().trials == 10
    assert one_by_one(tmp_path / "run") is Outcome.BUDGET_SPENT
    assert JournalReader(tmp_path / "run").spent().trials == 10
    assert one_by_one(tmp_path / "run", more={"trials": 7}) is Outcome.BUDGET_SPENT
    assert JournalReader(tmp_path / "run").spent().trials == 17
    assert one_by_one(tmp_path / "run", more={"trials": 1000}) is Outcome.FINISHED


def test_a_robot_that_takes_batches_gets_one_that_fits(tmp_path: Path) -> None:
    config = config_of(GOAL, "budget.trials=10")
    with Experiment.create(config, tmp_path / "run") as experiment, config.robot.build() as robot:
        assert experiment.evolve(robot) is Outcome.BUDGET_SPENT
    assert JournalReader(tmp_path / "run").spent().trials == 10


def test_a_budget_of_robot_time_is_never_overdrawn_and_no_trial_is_cut(tmp_path: Path) -> None:
    # before enough trials are measured one counts as long as it may be: 60 steps of 0.2 s
    assert one_by_one(tmp_path / "run", "budget.robot_time=100s") is Outcome.BUDGET_SPENT
    reader = JournalReader(tmp_path / "run")
    assert 100 - 12 - 1e-9 < reader.spent().robot_s <= 100
    assert all(row.fitness is not None for row in reader.attempts(0))
    assert one_by_one(tmp_path / "run", more={"robot_s": 50.0}) is Outcome.BUDGET_SPENT
    assert 138 - 1e-9 < JournalReader(tmp_path / "run").spent().robot_s <= 150


def test_a_generation_that_does_not_fit_is_not_begun_if_that_is_wanted(tmp_path: Path) -> None:
    whole = ("budget.trials=20", "budget.whole_generations=true")
    assert one_by_one(tmp_path / "run", *whole) is Outcome.BUDGET_SPENT
    assert JournalReader(tmp_path / "run").spent().trials == 18


def test_down_time_costs_no_wall_time(tmp_path: Path) -> None:
    one_by_one(tmp_path / "run", "budget.trials=3")
    before = JournalReader(tmp_path / "run").spent().wall_s
    assert 0 < before < 60
    assert JournalReader(tmp_path / "run").spent().wall_s == before


def test_a_wall_time_that_is_over_ends_the_run(tmp_path: Path) -> None:
    # the first trial may take 60 steps of 0.2 s, which do not fit any more
    assert one_by_one(tmp_path / "run", "budget.wall_time=11.9s") is Outcome.BUDGET_SPENT
    assert JournalReader(tmp_path / "run").spent().trials == 0


def test_battery_counts_what_goes_out_and_not_what_a_swap_brings(tmp_path: Path) -> None:
    levels = iter([1.0, 0.75, 0.5, 1.0, 0.75, 0.5, 0.25] + [0.25] * 100)
    config = config_of(GOAL, "budget.battery_charges=1.1")

    class Draining(Beside):
        def run(self, trials):  # type: ignore[no-untyped-def]
            self.health_now = replace(self.health_now, battery_fraction=next(levels))
            return super().run(trials)

    with Experiment.create(config, tmp_path / "run") as experiment, Draining(config.robot.build()) as robot:
        assert experiment.evolve(robot) is Outcome.BUDGET_SPENT
    spent = JournalReader(tmp_path / "run").spent()
    assert spent.battery_charges == pytest.approx(1.0)
    assert spent.trials == 6


@pytest.mark.parametrize("limit", ["robot_s", "wall_s", "trials", "battery_charges"])
def test_a_refusal_names_what_is_used_up(limit: str) -> None:
    meter = Meter(replace(INFINITE, **{limit: 0.5}), Amounts(), longest_trial_s=10.0)
    for battery in (1.0, 0.6):
        meter.add([10.0], 1.0, battery)
    assert meter.refusal() is not None
    assert Meter(INFINITE, Amounts(1e9, 1e9, 1e9, 1e9), 10.0).refusal() is None


@pytest.mark.parametrize(
    ("text", "seconds"), [("45s", 45), ("90min", 5400), ("2h", 7200), ("1h30min", 5400), ("1.5h", 5400), ("1d", 86400)]
)
def test_durations_as_people_write_them(text: str, seconds: float) -> None:
    assert parse_duration_s(text) == seconds


@pytest.mark.parametrize("text", ["", "2", "h", "2 hours", "-2h", "2h-"])
def test_other_text_is_no_duration(text: str) -> None:
    with pytest.raises(ValueError, match="expected a duration"):
        parse_duration_s(text)


def test_a_rehearsal_is_the_whole_run_with_a_stand_in(tmp_path: Path) -> None:
    from sceann_hil.supervision.operators.staff import staffed_desk

    config = config_of(GOAL, "algorithm.generations=1")
    with (
        rehearsal(config) as play,
        Experiment.create(play.config, tmp_path / "run") as experiment,
        play.robot as robot,
        staffed_desk(robot, play.config.operator, lambda _: None) as desk,
    ):
        assert experiment.evolve(robot, desk=desk) is Outcome.FINISHED
    rows = [row for g in (0, 1) for row in JournalReader(tmp_path / "run").attempts(g)]
    assert len(rows) == 2 * 6 * 3
    assert all(row.operator_s is not None for row in rows)

"""When a run will end: what is expected from durations that hold still, rise, or meet a budget."""

from __future__ import annotations

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.journal import JournalReader
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.supervision.budget import Amounts
from sceann_hil.supervision.forecast import Cost, Forecast
from sceann_hil.supervision.trend import LogCourse, Trend
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside

UNLIMITED = Amounts.unlimited()
EVERYTHING = ["robot_s", "wall_s", "trials", "battery_charges"]


def forecast_of(*generations_s: float, before: tuple[tuple[int, Cost], ...] = ()) -> Forecast:
    """21 generations of 5 trials of at most 60 s; those that are given are over, at 2 s of a person per trial."""
    forecast = Forecast(20, 5, 60.0, before)
    for number, robot_s in enumerate(generations_s):
        forecast.begin(number, 5)
        for _ in range(5):
            forecast.add([robot_s], 2.0)
    return forecast


def test_before_anything_is_measured_every_trial_lasts_to_its_limit() -> None:
    end = forecast_of().ending(UNLIMITED)
    assert (end.trials, end.wall_s, end.by_budget) == (105.0, 105 * 60.0, False)
    assert forecast_of().text(UNLIMITED) == ""


def test_what_holds_still_goes_on() -> None:
    end = forecast_of(*[10.0] * 8).ending(UNLIMITED)
    assert end.trials == 5 * (21 - 8)
    assert end.wall_s == pytest.approx(65 * 12.0)
    assert end.at_limit_s == pytest.approx(65 * 62.0)


def test_what_rises_goes_on_rising_but_not_beyond_the_step_limit() -> None:
    rising = forecast_of(*(5.0 * (1 + number) for number in range(8))).ending(UNLIMITED)
    assert 65 * 42.0 < rising.wall_s <= 65 * 62.0


@pytest.mark.parametrize("limit", EVERYTHING)
def test_the_first_limit_that_is_met_ends_the_run(limit: str) -> None:
    each = Amounts(10.0, 12.0, 1.0, 0.01)
    left = replace(UNLIMITED, **{limit: 7.5 * getattr(each, limit)})
    end = forecast_of(*[10.0] * 8).ending(left, battery_per_trial=0.01)
    assert end.by_budget
    assert end.trials == pytest.approx(7.5)
    assert end.wall_s == pytest.approx(7.5 * 12.0)


def test_a_budget_that_is_overspent_ends_the_run_now() -> None:
    assert forecast_of(*[10.0] * 8).ending(replace(UNLIMITED, robot_s=-1.0)).wall_s == 0.0


def test_a_person_reads_when_and_whether_the_budget_ends_it() -> None:
    forecast = forecast_of(*[10.0] * 8)
    assert forecast.text(UNLIMITED) == ("run ends in about 0:13:00, in 1:07:10 if every trial lasts to its step limit")
    assert forecast.text(replace(UNLIMITED, wall_s=60.0)) == "budget ends in about 0:01:00"
    assert forecast.text(replace(UNLIMITED, robot_s=120.0)) == "budget ends in about 0:02:24"


def test_attempts_that_are_settled_before_a_generation_begins_count() -> None:
    """Regression: they counted as a generation -1, whose logarithm is none."""
    forecast = Forecast(20, 5, 60.0, [(0, Cost(3, 30.0, 6.0))])
    forecast.add([10.0], 2.0)
    for number in range(12):
        forecast.begin(number, 5)
        for _ in range(5):
            forecast.add([10.0], 2.0)
        assert forecast.ending(UNLIMITED).wall_s == pytest.approx((20 - number) * 5 * 12.0)


def test_a_resumed_run_knows_what_its_trials_took(tmp_path: Path) -> None:
    config = config_of(GOAL, "budget.trials=20", "algorithm.generations=1")
    with Experiment.create(config, tmp_path / "run") as experiment, Beside(config.robot.build()) as robot:
        assert experiment.evolve(robot) is Outcome.BUDGET_SPENT
    costs = [(row[0], Cost(*row[1:])) for row in JournalReader(tmp_path / "run").costs()]
    assert sum(cost.attempts for _, cost in costs) == 20
    assert sum(cost.robot_s for _, cost in costs) == pytest.approx(JournalReader(tmp_path / "run").spent().robot_s)
    assert "run ends in about" in Forecast(1, 18, 12.0, costs).text(UNLIMITED)


def test_a_million_generations_cost_no_more_than_ten() -> None:
    """Regression: every event computed with arrays as long as the run; a generation kept a gigabyte."""
    forecast = Forecast(1_000_000, 5, 60.0)
    tracemalloc.start()
    for number in range(2000):
        forecast.begin(number, 5)
        for _ in range(5):
            forecast.add([10.0], 2.0)
        if number == 100:
            before, _ = tracemalloc.get_traced_memory()
    end = forecast.ending(UNLIMITED)
    after, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert end.wall_s == pytest.approx((1_000_001 - 2000) * 5 * 12.0)
    assert after - before < 10_000
    assert most - before < 100_000


def test_the_formula_is_the_sum_over_generations() -> None:
    rng = np.random.default_rng(5)
    for _ in range(200):
        ends = np.sort(rng.uniform(0.0, 60.0, 2))
        course = LogCourse(rng.uniform(-10, 50), rng.choice([0.0, rng.uniform(-20, 20)]), *ends)
        first, n = int(rng.integers(0, 200)), int(rng.integers(0, 300))
        expected = sum(course.at(generation) for generation in range(first, first + n))
        assert course.sum(first, first + n - 1) == pytest.approx(expected, abs=1e-6)


def test_the_line_is_the_least_squares_line() -> None:
    x, y = np.random.default_rng(6).random((2, 50))
    trend = Trend()
    for pair in zip(x.tolist(), y.tolist(), strict=True):
        trend.add(*pair)
    assert trend.slope == pytest.approx(np.polyfit(x, y, 1)[0])

"""What a configuration will cost, from the configuration alone."""

from __future__ import annotations

import pytest

from sceann_hil.run.plan import PROMPT_S, Plan
from tests.runs import GOAL, config_of

REAL = """
task: {type: pole_balancing, max_steps: 100}
robot: {type: remote, port: nowhere, n_sensors: 2, n_motors: 1, tick_s: 0.02, bumper: fell,
  start_fields: [x_m, velocity_m_s, angle_rad, angular_velocity_rad_s]}
controller: {coding: sceann3, n_hidden: 3}
algorithm: {type: sga, population: 3, generations: 4}
"""


def test_trials_and_robot_time_are_those_of_every_trial_to_its_limit() -> None:
    plan = Plan.of(config_of(GOAL))
    assert (plan.generations, plan.population, plan.trials_per_individual) == (4, 6, 3)
    assert plan.trials == 4 * 6 * 3
    assert plan.longest_trial_s == pytest.approx(60 * 0.2)
    assert plan.longest_robot_s == pytest.approx(plan.trials * plan.longest_trial_s)
    assert (plan.prompts, plan.simulated, plan.fits) == (0, True, "")


@pytest.mark.parametrize(("confirm", "each"), [(True, 2), (False, 1)])
def test_a_person_is_asked_before_every_trial_and_after_it_where_that_is_wanted(confirm: bool, each: int) -> None:
    plan = Plan.of(config_of(REAL, f"operator.confirm={str(confirm).lower()}"))
    assert plan.prompts == 15 * each
    assert plan.longest_wall_s == pytest.approx(15 * 2.0 + plan.prompts * PROMPT_S)
    assert not plan.simulated


@pytest.mark.parametrize(
    ("budget", "fits"),
    [("trials=15", "yes"), ("trials=14", "not surely: trials"), ("robot_time=29s", "not surely: robot_s")],
)
def test_it_says_whether_the_budget_suffices(budget: str, fits: str) -> None:
    assert Plan.of(config_of(REAL, f"budget.{budget}")).fits.startswith(fits)


def test_a_long_plan_is_made_at_once() -> None:
    assert Plan.of(config_of(GOAL, "algorithm.generations=10000000")).trials == 10_000_001 * 18

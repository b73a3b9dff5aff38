"""Robustness is success in bodies that differ, measured the same way every time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from backends.simulation.engine import SimulatedRobot
from sceann_hil.config import ExperimentConfig, parse_config
from sceann_hil.errors import ConfigError
from sceann_hil.network.coding import Bits
from sceann_hil.robot import EndReason, Results, RobotSpec, Trials, TrialVoid
from sceann_hil.study.landscape import genomes_of
from sceann_hil.study.robustness import Criterion, Robustness, disturbances_of, measure

POLE = """\
task: {type: pole_balancing, max_steps: 300}
robot: {type: cartpole}
controller: {coding: sceann3, n_hidden: 3}
algorithm: {type: sga}
"""
GOAL = """\
task: {type: goal_reach}
robot: {type: diffdrive, n_sensors: 3}
controller: {coding: sceann3, n_hidden: 2}
algorithm: {type: sga}
"""


@pytest.fixture(scope="module")
def config() -> ExperimentConfig:
    return parse_config(POLE, "test")


@pytest.fixture(scope="module")
def genomes(config: ExperimentConfig) -> Bits:
    # one that balances for all 3,000 steps, one that does not, and random ones
    numbers = np.array([0xCA5D1A, 0x000000, *np.random.default_rng(1).integers(0, 2**24, 6)])
    return genomes_of(numbers, config.genome_length)


@pytest.fixture(scope="module")
def found(config: ExperimentConfig, genomes: Bits) -> Robustness:
    return measure(config, genomes, repeats=4)


def test_the_undisturbed_level_is_the_experiment_itself(found: Robustness) -> None:
    for levels in found.success:
        assert levels[0, 0] == 1.0
        assert levels[0, 1] == 0.0
        np.testing.assert_array_equal(levels[0], found.success[0][0])


def test_worse_bodies_are_harder(found: Robustness) -> None:
    by_name = dict(zip((d.name for d in found.disturbances), found.success, strict=True))
    assert set(by_name) == {"sensor noise", "sensor offset", "motor gain error", "latency", "initial angle"}
    for name in ("sensor noise", "sensor offset", "latency"):
        assert by_name[name][-1, 0] < 1.0
    assert by_name["initial angle"][:, 0].min() == 1.0


def test_the_score_is_the_mean_over_disturbances_without_the_undisturbed_levels(found: Robustness) -> None:
    expected = np.mean([np.mean(levels[1:], axis=0) for levels in found.success], axis=0)
    np.testing.assert_allclose(found.score, expected)
    assert found.score[0] > 0.3
    assert found.score[1] == 0.0


def test_a_controller_s_numbers_do_not_change_when_measured_again(
    config: ExperimentConfig, genomes: Bits, found: Robustness
) -> None:
    again = measure(config, genomes[:2], repeats=4)
    for one, other in zip(found.success, again.success, strict=True):
        np.testing.assert_array_equal(one[:, :2], other)


def test_goal_reach_is_disturbed_in_its_headings() -> None:
    config = parse_config(GOAL, "test")
    *_, headings = disturbances_of(config)
    assert headings.name == "initial headings turned by"
    found = measure(config, genomes_of(np.array([5, 6]), config.genome_length), repeats=1)
    assert [levels.shape for levels in found.success] == [(6, 2)] * 5


def test_a_robot_without_a_reality_gap_is_refused(config: ExperimentConfig) -> None:
    from sceann_hil.plugins import RobotConfig

    class Bare(RobotConfig):
        type: str = "bare"

        @property
        def spec(self) -> RobotSpec:
            return replace(config.robot.spec, name="bare")

        def build(self) -> None:  # type: ignore[override]
            raise AssertionError

    with pytest.raises(ConfigError, match="bare has none"):
        disturbances_of(config.model_copy(update={"robot": Bare()}))


def test_the_fitness_in_disturbed_bodies_is_a_mean_over_the_same_trials(
    config: ExperimentConfig, genomes: Bits, found: Robustness
) -> None:
    expected = np.mean([np.mean(levels[1:], axis=0) for levels in found.fitness], axis=0)
    np.testing.assert_allclose(found.mean(Criterion.FITNESS), expected)
    np.testing.assert_array_equal(found.mean(Criterion.SUCCESS), found.score)
    # fitness of pole balancing is the number of steps, so success is full fitness
    assert all(np.all((fitness == 300.0) == (success == 1.0)) for fitness, success in zip_levels(found))


def zip_levels(found: Robustness) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    return zip(found.fitness, found.success, strict=True)


def test_intervals_of_the_mean_fitness_hold_it_about_as_often_as_they_say(
    config: ExperimentConfig, genomes: Bits
) -> None:
    balancing = genomes[:1]
    truth = float(measure(config.with_changes(seed=99), balancing, repeats=600).mean(Criterion.FITNESS)[0])
    held = 0
    for seed in range(60):
        interval = measure(config.with_changes(seed=seed), balancing, repeats=12).fitness_interval(0)
        held += interval.low <= truth <= interval.high
    assert held >= 52


def test_differences_between_controllers_have_intervals(found: Robustness) -> None:
    better = found.fitness_difference(0, 1)
    assert better.low > 0.0
    same = found.fitness_difference(0, 0)
    assert same.estimate == 0.0
    assert same.contains_zero
    means = found.mean(Criterion.FITNESS)
    assert better.estimate == pytest.approx(means[0] - means[1])


def test_a_single_repeat_gives_no_interval(config: ExperimentConfig, genomes: Bits) -> None:
    interval = measure(config, genomes[:2], repeats=1).fitness_interval(0)
    assert (interval.low, interval.high) == (-np.inf, np.inf)


def test_a_robot_with_one_gap_for_life_is_disturbed_anew_in_every_trial(config: ExperimentConfig) -> None:
    fixed = config.with_changes({"robot.gap": {"drawn": "per_robot", "robot": 3}})
    assert all(change["robot.gap.drawn"] == "per_trial" for change in disturbances_of(fixed)[0].changes)
    fixed.with_changes(disturbances_of(fixed)[1].changes[-1])


def test_a_void_trial_is_no_failure(config: ExperimentConfig, genomes: Bits, monkeypatch: pytest.MonkeyPatch) -> None:
    run = SimulatedRobot.run

    def void(robot: SimulatedRobot, trials: Trials) -> Results:
        results = run(robot, trials)
        results.end_reasons[:1] = EndReason.LINK_LOST
        return results

    monkeypatch.setattr(SimulatedRobot, "run", void)
    with pytest.raises(TrialVoid):
        measure(config, genomes[:2], repeats=2)

"""Robustness is success in bodies that differ, measured the same way every time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sceann_hil.config import ExperimentConfig, parse_config
from sceann_hil.errors import ConfigError
from sceann_hil.network.coding import Bits
from sceann_hil.robot import RobotSpec
from sceann_hil.study.landscape import genomes_of
from sceann_hil.study.robustness import Robustness, disturbances_of, measure

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

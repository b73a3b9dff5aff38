"""The gap report finds the gap that was put there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backends.cartpole import CartPole
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.run.measuring import simulate
from sceann_hil.study.gap import GapReport, Spread
from sceann_hil.supervision.drift import Drift
from sceann_hil.tasks.pole_balancing import PoleBalancing, PoleBalancingConfig

PHENOTYPE = Phenotype(Coding.SCEANN3, NetworkSize(2, 3, 1), Dynamics())
TASK = PoleBalancing(PoleBalancingConfig(max_steps=300, start_angle_deg=4.0))


def genomes(n: int) -> np.ndarray:  # type: ignore[type-arg]
    return np.random.default_rng(5).integers(0, 2, (n, 24), dtype=np.uint8)


def test_a_robot_like_its_simulation_has_no_gap_and_the_same_order() -> None:
    with CartPole() as robot:
        one, other = (simulate(robot, PHENOTYPE, TASK, genomes(12), 2, seed) for seed in (1, 2))
    report = GapReport.of([str(i) for i in range(12)], one, replace(other, robot="robot"), None)
    assert report.rank_correlation == pytest.approx(1.0)
    assert all((gap.gap, gap.low, gap.high) == (0.0, 0.0, 0.0) for gap in report.genomes)


def test_intervals_hold_a_known_difference_about_as_often_as_they_say() -> None:
    rng = np.random.default_rng(1)
    held = 0
    with CartPole() as robot:
        base = simulate(robot, PHENOTYPE, TASK, genomes(1), 1, 1)
    for _ in range(400):
        simulated, measured = rng.normal(0.0, 1.0, (1, 8, 1)), rng.normal(0.5, 2.0, (1, 8, 1))
        report = GapReport.of(["0"], replace(base, fitness=simulated), replace(base, fitness=measured), None)
        held += report.genomes[0].low <= 0.5 <= report.genomes[0].high
    assert 0.92 < held / 400 < 0.98


def test_the_spread_s_interval_and_the_repeats_to_tell_two_apart() -> None:
    spread = Spread.of(np.array([1.0, 2.0, 3.0, 4.0, 5.0]))
    assert (spread.mean, spread.deviation) == (3.0, pytest.approx(1.5811, abs=1e-4))
    assert (spread.low, spread.high) == (pytest.approx(1.0368, abs=1e-4), pytest.approx(4.9632, abs=1e-4))
    # Cohen 1988: d = 0.5 at alpha 0.05 and power 0.8 needs 63 to 64 per group
    assert replace(spread, deviation=1.0).repeats_to_tell(0.5) == 63
    with pytest.raises(ValueError, match="at least 2"):
        Spread.of(np.array([1.0]))


def test_drift_is_found_where_there_is_one_and_seldom_where_there_is_none() -> None:
    rng = np.random.default_rng(2)
    assert Drift.of((np.linspace(1.0, 0.7, 15) + rng.normal(0, 0.05, 15)).tolist()).warning is not None
    false_alarms = sum(Drift.of(rng.normal(0, 1, 15).tolist()).warning is not None for _ in range(500))
    assert false_alarms <= 15
    assert Drift.of([]).warning is None
    assert Drift.of([1.0] * 20).warning is None

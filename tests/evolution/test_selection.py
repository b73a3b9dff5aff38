"""Tournaments and elitism: direction, sampling and ties, against their exact distributions."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest
from scipy import stats

from sceann_hil.evolution.selection import best_individuals, pick, tournament

LEAST_P = 1e-4
"""Seeds are fixed, so a test fails always or never; a right distribution fails with this probability."""


def test_pick_is_uniform_and_stays_in_range() -> None:
    rng = np.random.default_rng(1)
    counts = np.bincount([pick(7, rng) for _ in range(14_000)], minlength=7)
    assert counts.size == 7
    assert stats.chisquare(counts).pvalue > LEAST_P


@pytest.mark.parametrize("size", [1, 2, 6])
def test_winners_follow_the_distribution_of_tournaments_with_replacement(size: int) -> None:
    rng = np.random.default_rng(size)
    fitness = np.array([0.3, -1.0, 7.0, 2.0, 0.5])
    counts = np.bincount([tournament(fitness, size, rng) for _ in range(20_000)], minlength=5)
    rank = fitness.argsort().argsort()
    probability = ((rank + 1.0) ** size - rank.astype(float) ** size) / 5.0**size
    assert stats.chisquare(counts, 20_000 * probability).pvalue > LEAST_P


@pytest.mark.parametrize("size", [2, 6])
def test_tied_contestants_win_equally_often(size: int) -> None:
    rng = np.random.default_rng(size)
    fitness = np.array([4.0, 1.0, 4.0, 4.0, 1.0])
    counts = np.bincount([tournament(fitness, size, rng) for _ in range(20_000)], minlength=5)
    worse_wins = (2 / 5) ** size
    probability = np.where(fitness == 4.0, (1 - worse_wins) / 3, worse_wins / 2)
    assert stats.chisquare(counts, 20_000 * probability).pvalue > LEAST_P


@pytest.mark.parametrize("fitness", [[-5.0, -2.0, -9.0], [0.0, 3000.0, 2999.0], [1.0, 1.0 + 2**-52, 1.0]])
def test_larger_fitness_is_better(fitness: list[float]) -> None:
    rng = np.random.default_rng(0)
    assert best_individuals(np.array(fitness), 1, rng).tolist() == [1]
    assert {tournament(np.array(fitness), 200, rng) for _ in range(50)} == {1}


def test_the_best_individuals_come_best_first_and_differ() -> None:
    fitness = np.array([2.0, 9.0, -1.0, 5.0])
    rng = np.random.default_rng(0)
    for count in range(5):
        assert best_individuals(fitness, count, rng).tolist() == [1, 3, 0, 2][:count]


def test_ties_for_the_best_are_broken_uniformly() -> None:
    rng = np.random.default_rng(3)
    fitness = np.array([8.0, 1.0, 8.0, 8.0, 0.0, 8.0])
    counts = Counter(int(best_individuals(fitness, 1, rng)[0]) for _ in range(12_000))
    assert set(counts) == {0, 2, 3, 5}
    assert stats.chisquare(list(counts.values())).pvalue > LEAST_P


def test_ties_for_several_elites_are_broken_uniformly() -> None:
    rng = np.random.default_rng(4)
    fitness = np.array([8.0, 8.0, 1.0, 8.0])
    counts = Counter(tuple(best_individuals(fitness, 2, rng).tolist()) for _ in range(12_000))
    assert set(counts) == set(itertools.permutations((0, 1, 3), 2))
    assert stats.chisquare(list(counts.values())).pvalue > LEAST_P

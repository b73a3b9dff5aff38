"""Gaps between flips, and what they make of whole genomes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from sceann_hil.evolution import SGA, SGAConfig
from sceann_hil.evolution.mutation import NEVER, bits_until_flip

LEAST_P = 1e-4


@pytest.mark.parametrize("rate", [0.04, 0.3, 0.9])
def test_gaps_are_geometric(rate: float) -> None:
    rng = np.random.default_rng(5)
    gaps = np.array([bits_until_flip(rate, rng) for _ in range(20_000)])
    expected = 20_000 * rate * (1 - rate) ** np.arange(1000)
    last = int(np.flatnonzero(expected >= 20)[-1])
    counts = np.append(np.bincount(gaps, minlength=last)[:last], np.sum(gaps >= last))
    assert stats.chisquare(counts, np.append(expected[:last], 20_000 - expected[:last].sum())).pvalue > LEAST_P


def test_rate_zero_never_flips_and_rate_one_flips_every_bit() -> None:
    rng = np.random.default_rng(0)
    assert {bits_until_flip(0.0, rng) for _ in range(100)} == {int(NEVER)}
    assert {bits_until_flip(1.0, rng) for _ in range(100)} == {0}


def test_the_smallest_rates_do_not_overflow() -> None:
    rng = np.random.default_rng(0)
    assert all(0 <= bits_until_flip(rate, rng) <= int(NEVER) for rate in (5e-324, 1e-300, 1e-18) for _ in range(100))


def _flips(genome_length: int, rate: float | None, tells: int, seed: int) -> np.ndarray:
    """Which bits of children differ from their parents', shape ``(children, L)``."""
    algorithm = SGA(genome_length, SGAConfig(mutation_rate=rate))
    rng = np.random.default_rng(seed)
    state = algorithm.start(rng)
    flips = []
    for _ in range(tells):
        children = algorithm.tell(state, np.zeros(25), rng)
        flips.append(children.genomes[1:] ^ state.genomes[children.parents[1:]])
    return np.concatenate(flips)


def test_every_locus_mutates_with_the_same_rate() -> None:
    flips = _flips(30, None, 1000, seed=6)
    counts = flips.sum(axis=0)
    assert stats.chisquare(counts).pvalue > LEAST_P
    assert stats.binomtest(int(counts.sum()), flips.size, 1 / 30).pvalue > LEAST_P


def test_every_child_mutates_with_the_same_rate() -> None:
    counts = _flips(30, 0.1, 1000, seed=7).reshape(1000, 24, 30).sum(axis=(0, 2))
    assert stats.chisquare(counts).pvalue > LEAST_P


def test_flips_per_child_are_binomial() -> None:
    flips = _flips(10, 0.2, 1000, seed=8).sum(axis=1)
    counts = np.bincount(np.minimum(flips, 7), minlength=8)
    expected = stats.binom.pmf(np.arange(8), 10, 0.2)
    expected[7] = stats.binom.sf(6, 10, 0.2)
    assert stats.chisquare(counts, expected * flips.size).pvalue > LEAST_P


def test_neighbouring_bits_flip_independently() -> None:
    flips = _flips(2, 0.3, 1000, seed=9)
    counts = np.bincount(flips[:, 0] * 2 + flips[:, 1], minlength=4)
    expected = np.array([0.49, 0.21, 0.21, 0.09]) * len(flips)
    assert stats.chisquare(counts, expected).pvalue > LEAST_P

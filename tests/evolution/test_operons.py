"""Connection and division: what they do to a partition, and how they choose."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from sceann_hil.evolution.oga import numbered_by_first_appearance
from sceann_hil.evolution.oga_options import Division, Scope
from sceann_hil.evolution.operons import connect, divide, random_operon, renumber

LEAST_P = 1e-4

partitions = st.lists(st.integers(0, 7), min_size=1, max_size=12).map(
    lambda labels: numbered_by_first_appearance(np.array(labels))
)
seeds = st.integers(0, 2**32)
probabilities = st.sampled_from([0.0, 0.3, 1.0])


def _blocks(operons: np.ndarray) -> set[frozenset[int]]:
    return {frozenset(np.flatnonzero(operons == label).tolist()) for label in set(operons.tolist())}


def _is_numbered_without_gaps(operons: np.ndarray, n_operons: int) -> bool:
    return sorted(set(operons.tolist())) == list(range(n_operons))


@settings(deadline=None)
@given(partitions, st.sampled_from(Scope), probabilities, seeds)
def test_connection_only_merges_operons(before: np.ndarray, scope: Scope, probability: float, seed: int) -> None:
    after = before.copy()
    n = connect(after, int(before.max()) + 1, scope.code, probability, np.random.default_rng(seed))
    assert _is_numbered_without_gaps(after, n)
    assert all(any(old <= new for new in _blocks(after)) for old in _blocks(before))


@settings(deadline=None)
@given(partitions, st.sampled_from(Scope), st.sampled_from(Division), probabilities, seeds)
def test_division_only_splits_operons(
    before: np.ndarray, scope: Scope, rule: Division, probability: float, seed: int
) -> None:
    after = before.copy()
    n = divide(after, int(before.max()) + 1, scope.code, rule.code, probability, np.random.default_rng(seed))
    assert _is_numbered_without_gaps(after, n)
    assert all(any(new <= old for old in _blocks(before)) for new in _blocks(after))


@settings(deadline=None)
@given(partitions, seeds)
def test_probability_zero_changes_no_operon(before: np.ndarray, seed: int) -> None:
    after = before.copy()
    rng = np.random.default_rng(seed)
    n = connect(after, int(before.max()) + 1, Scope.PER_OPERON.code, 0.0, rng)
    divide(after, n, Scope.PER_OPERON.code, Division.ANY_OPERON.code, 0.0, rng)
    assert np.array_equal(after, before)


@settings(deadline=None)
@given(partitions)
def test_renumbering_gives_the_canonical_form_of_the_same_partition(canonical: np.ndarray) -> None:
    n_operons = int(canonical.max()) + 1
    shuffled = np.random.default_rng(0).permutation(n_operons).astype(np.int16)[canonical]
    renumber(shuffled, n_operons)
    assert np.array_equal(shuffled, canonical)


@pytest.mark.parametrize(("scope", "operons_left"), [(Scope.PER_OPERON, 1), (Scope.PER_INDIVIDUAL, 4)])
def test_certain_connection_draws_once_per_operon_or_once(scope: Scope, operons_left: int) -> None:
    operons = np.arange(5, dtype=np.int16)
    assert connect(operons, 5, scope.code, 1.0, np.random.default_rng(0)) == operons_left


def test_connection_draws_are_counted_before_it_begins() -> None:
    rng = np.random.default_rng(1)
    merges = [5 - connect(np.arange(5, dtype=np.int16), 5, Scope.PER_OPERON.code, 0.3, rng) for _ in range(10_000)]
    expected = stats.binom.pmf(np.arange(6), 5, 0.3)
    expected[4] += expected[5]
    assert stats.chisquare(np.bincount(merges, minlength=5), expected[:5] * 10_000).pvalue > LEAST_P


def test_every_pair_is_connected_equally_often() -> None:
    rng = np.random.default_rng(2)
    pairs: Counter[frozenset[int]] = Counter()
    for _ in range(6_000):
        operons = np.arange(4, dtype=np.int16)
        connect(operons, 4, Scope.PER_INDIVIDUAL.code, 1.0, rng)
        pairs[next(block for block in _blocks(operons) if len(block) == 2)] += 1
    assert len(pairs) == 6
    assert stats.chisquare(list(pairs.values())).pvalue > LEAST_P


def test_the_size_biased_scope_chooses_operons_by_their_loci() -> None:
    rng = np.random.default_rng(3)
    operons = np.array([0, 1, 1, 1, 2, 2], dtype=np.int16)
    for scope, expected in ((Scope.SIZE_BIASED, [1 / 6, 3 / 6, 2 / 6]), (Scope.PER_INDIVIDUAL, [1 / 3] * 3)):
        counts = np.bincount([random_operon(operons, 3, scope.code, rng) for _ in range(9_000)], minlength=3)
        assert stats.chisquare(counts, np.array(expected) * 9_000).pvalue > LEAST_P


@pytest.mark.parametrize("rule", [Division.ANY_OPERON, Division.DIVISIBLE_OPERON])
def test_cuts_are_uniform_over_the_inner_places_of_an_operon(rule: Division) -> None:
    rng = np.random.default_rng(4)
    sizes = []
    for _ in range(8_000):
        operons = np.zeros(5, dtype=np.int16)
        divide(operons, 1, Scope.PER_INDIVIDUAL.code, rule.code, 1.0, rng)
        assert operons.tolist() == sorted(operons.tolist())
        sizes.append(int(np.sum(operons == 0)))
    assert stats.chisquare(np.bincount(sizes, minlength=5)[1:]).pvalue > LEAST_P


def test_a_random_bipartition_is_uniform_over_all_splits() -> None:
    rng = np.random.default_rng(5)
    splits: Counter[tuple[int, ...]] = Counter()
    for _ in range(7_000):
        operons = np.zeros(4, dtype=np.int16)
        renumber(operons, divide(operons, 1, Scope.PER_INDIVIDUAL.code, Division.RANDOM_BIPARTITION.code, 1.0, rng))
        splits[tuple(operons.tolist())] += 1
    assert len(splits) == 2**3 - 1
    assert stats.chisquare(list(splits.values())).pvalue > LEAST_P


def test_division_may_hit_a_single_locus_unless_told_otherwise() -> None:
    rng = np.random.default_rng(6)
    after = {rule: set[int]() for rule in Division}
    for rule in Division:
        for _ in range(200):
            operons = np.array([0, 1, 1], dtype=np.int16)
            after[rule].add(divide(operons, 2, Scope.PER_INDIVIDUAL.code, rule.code, 1.0, rng))
    assert after == {
        Division.ANY_OPERON: {2, 3},
        Division.DIVISIBLE_OPERON: {3},
        Division.RANDOM_BIPARTITION: {2, 3},
    }

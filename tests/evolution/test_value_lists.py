"""The operators on value lists, against plain Python lists."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from sceann_hil.evolution.oga import numbered_by_first_appearance
from sceann_hil.evolution.oga_options import BitMutation, Deletion, Duplication, FullList, Inversion, Scope
from sceann_hil.evolution.value_lists import choose_groups, delete, duplicate, invert, mutate_values

LEAST_P = 1e-4


@dataclass
class Individual:
    """Lists as Python has them, and the same as arrays."""

    lists: list[list[int]]
    cap: int
    groups: np.ndarray
    chosen: np.ndarray

    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        values = np.zeros((len(self.lists), self.cap), dtype=np.uint8)
        for locus, bits in enumerate(self.lists):
            values[locus, : len(bits)] = bits
        return values, np.array([len(bits) for bits in self.lists], dtype=np.uint8)


def _lists(values: np.ndarray, lengths: np.ndarray) -> list[list[int]]:
    assert lengths.min() >= 1
    assert lengths.max() <= values.shape[1]
    assert not np.any(values[np.arange(values.shape[1]) >= lengths[:, None]])
    return [row[:length].tolist() for row, length in zip(values, lengths, strict=True)]


@st.composite
def individuals(draw: st.DrawFn, equal_values: bool = False) -> Individual:
    cap = draw(st.integers(1, 8))
    if equal_values:
        one_list = st.tuples(st.integers(0, 1), st.integers(1, cap)).map(lambda pair: [pair[0]] * pair[1])
    else:
        one_list = st.lists(st.integers(0, 1), min_size=1, max_size=cap)
    lists = draw(st.lists(one_list, min_size=1, max_size=10))
    labels = draw(st.lists(st.integers(0, 4), min_size=len(lists), max_size=len(lists)))
    groups = numbered_by_first_appearance(np.array(labels))
    n_groups = int(groups.max()) + 1
    chosen = draw(st.lists(st.booleans(), min_size=n_groups, max_size=n_groups))
    return Individual(lists, cap, groups, np.array(chosen))


def _longer(bits: list[int], rule: Duplication) -> list[int]:
    match rule:
        case Duplication.HEAD_TO_FRONT:
            return [bits[0], *bits]
        case Duplication.HEAD_TO_TAIL:
            return [*bits, bits[0]]
        case Duplication.DOUBLE_LIST:
            return bits + bits


@settings(deadline=None)
@given(individuals(), st.sampled_from(Duplication), st.sampled_from(FullList))
def test_duplication_equals_its_definition_and_keeps_every_head(
    individual: Individual, rule: Duplication, full_list: FullList
) -> None:
    values, lengths = individual.arrays()
    heads = values[:, 0].copy()
    duplicate(values, lengths, individual.groups, individual.chosen.copy(), rule.code, full_list.code)

    def overflows(locus: int) -> bool:
        return len(_longer(individual.lists[locus], rule)) > individual.cap

    blocked = {int(individual.groups[locus]) for locus in range(len(individual.lists)) if overflows(locus)}
    expected = []
    for locus, bits in enumerate(individual.lists):
        group = int(individual.groups[locus])
        skipped = (full_list is FullList.SKIP_LOCUS and overflows(locus)) or (
            full_list is FullList.SKIP_OPERON and group in blocked
        )
        if not individual.chosen[group] or skipped:
            expected.append(bits)
        elif rule is Duplication.HEAD_TO_TAIL and overflows(locus):
            expected.append([*bits[:-1], bits[0]])
        else:
            expected.append(_longer(bits, rule)[: individual.cap])
    assert _lists(values, lengths) == expected
    assert np.array_equal(values[:, 0], heads)


@settings(deadline=None)
@given(individuals(), st.sampled_from(Deletion), st.integers(0, 2**32))
def test_deletion_equals_its_definition_and_leaves_a_value(individual: Individual, rule: Deletion, seed: int) -> None:
    values, lengths = individual.arrays()
    delete(values, lengths, individual.groups, individual.chosen.copy(), rule.code, np.random.default_rng(seed))
    blocked = {int(group) for group, bits in zip(individual.groups, individual.lists, strict=True) if len(bits) < 2}
    for locus, (before, after) in enumerate(zip(individual.lists, _lists(values, lengths), strict=True)):
        group = int(individual.groups[locus])
        spared = rule is Deletion.WHOLE_OPERON and group in blocked
        if not individual.chosen[group] or len(before) < 2 or spared:
            assert after == before
        elif rule is Deletion.TAIL:
            assert after == before[:-1]
        elif rule is Deletion.RANDOM_VALUE:
            assert after in [before[:k] + before[k + 1 :] for k in range(len(before))]
        else:
            assert after == before[1:]


@settings(deadline=None)
@given(individuals(), st.sampled_from(Inversion), st.integers(0, 2**32))
def test_inversion_equals_its_definition(individual: Individual, rule: Inversion, seed: int) -> None:
    values, lengths = individual.arrays()
    invert(values, lengths, individual.groups, individual.chosen, rule.code, np.random.default_rng(seed))
    for locus, (before, after) in enumerate(zip(individual.lists, _lists(values, lengths), strict=True)):
        if not individual.chosen[individual.groups[locus]]:
            assert after == before
        elif rule is Inversion.REVERSE_LIST:
            assert after == before[::-1]
        elif rule is Inversion.COMPLEMENT_HEAD:
            assert after == [1 - before[0], *before[1:]]
        else:
            swaps = [[before[k], *before[1:k], before[0], *before[k + 1 :]] for k in range(1, len(before))]
            assert after in (swaps or [before])


@settings(deadline=None)
@given(
    individuals(equal_values=True),
    st.sampled_from(Deletion),
    st.sampled_from([Inversion.REVERSE_LIST, Inversion.SWAP_HEAD]),
    st.integers(0, 2**32),
)
def test_equal_values_make_deletion_and_inversion_neutral(
    individual: Individual, deletion: Deletion, inversion: Inversion, seed: int
) -> None:
    values, lengths = individual.arrays()
    heads = values[:, 0].copy()
    rng = np.random.default_rng(seed)
    delete(values, lengths, individual.groups, individual.chosen.copy(), deletion.code, rng)
    invert(values, lengths, individual.groups, individual.chosen, inversion.code, rng)
    assert np.array_equal(values[:, 0], heads)


@pytest.mark.parametrize("rule", [Deletion.RANDOM_VALUE, Inversion.SWAP_HEAD])
def test_random_places_are_uniform(rule: Deletion | Inversion) -> None:
    rng = np.random.default_rng(1)
    groups, chosen = np.zeros(1, dtype=np.int16), np.ones(1, dtype=np.bool_)
    counts = np.zeros(4, dtype=int)
    for _ in range(8_000):
        # Numbers instead of bits tell the places apart.
        values, lengths = np.array([[10, 11, 12, 13]], dtype=np.uint8), np.array([4], dtype=np.uint8)
        if isinstance(rule, Deletion):
            delete(values, lengths, groups, chosen, rule.code, rng)
            counts[({10, 11, 12, 13} - set(values[0, :3].tolist())).pop() - 10] += 1
        else:
            invert(values, lengths, groups, chosen, rule.code, rng)
            counts[values[0, 0] - 10] += 1
    possible = counts if isinstance(rule, Deletion) else counts[1:]
    assert possible.sum() == 8_000
    assert stats.chisquare(possible).pvalue > LEAST_P


def test_every_group_draws_on_its_own() -> None:
    rng = np.random.default_rng(2)
    groups = np.array([0, 1, 2], dtype=np.int16)
    for scope in (Scope.PER_OPERON, Scope.PER_LOCUS):
        counts = np.zeros(8)
        for _ in range(8_000):
            counts[choose_groups(groups, 3, scope.code, 0.6, rng) @ [4, 2, 1]] += 1
        chosen = np.array([bin(k).count("1") for k in range(8)])
        assert stats.chisquare(counts, 8_000 * 0.6**chosen * 0.4 ** (3 - chosen)).pvalue > LEAST_P


def test_once_per_individual_chooses_one_group_at_most() -> None:
    rng = np.random.default_rng(3)
    groups = np.array([0, 1, 1, 2], dtype=np.int16)
    for scope, sizes in ((Scope.PER_INDIVIDUAL, [1, 1, 1]), (Scope.SIZE_BIASED, [1, 2, 1])):
        draws = np.array([choose_groups(groups, 3, scope.code, 0.6, rng) for _ in range(8_000)])
        assert draws.sum(axis=1).max() == 1
        counts = np.append(draws.sum(axis=0), 8_000 - draws.sum())
        expected = np.append(0.6 * np.array(sizes) / sum(sizes), 0.4)
        assert stats.chisquare(counts, 8_000 * expected).pvalue > LEAST_P


def _flips(rule: BitMutation, rate: float, lengths: np.ndarray, rounds: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    counts = np.zeros((lengths.size, 6), dtype=int)
    for _ in range(rounds):
        values = np.zeros((lengths.size, 6), dtype=np.uint8)
        mutate_values(values, lengths, rule.code, rate, rng)
        counts += values
    return counts


LENGTHS = np.array([1, 6, 3, 2, 6, 1, 1, 4], dtype=np.uint8)
STORED = np.arange(6) < LENGTHS[:, None]


@pytest.mark.parametrize(
    ("rule", "rate", "expected"),
    [
        (BitMutation.ALL_STORED, 1 / 8, np.where(STORED, 1 / 8, 0)),
        (BitMutation.EXPRESSED_ONLY, 1 / 8, np.where(np.arange(6) == 0, np.full((8, 1), 1 / 8), 0)),
        (BitMutation.SHARED, 1 / 8, np.where(STORED, 1 / STORED.sum(), 0)),
    ],
)
def test_bit_mutation_flips_each_value_with_its_rate_whatever_the_list_lengths(
    rule: BitMutation, rate: float, expected: np.ndarray
) -> None:
    rounds = 20_000
    counts = _flips(rule, rate, LENGTHS, rounds, seed=4)
    assert not np.any(counts[expected == 0])
    heads, share = counts[:, 0], expected[0, 0]
    assert stats.chisquare(heads).pvalue > LEAST_P
    assert stats.binomtest(int(heads.sum()), rounds * LENGTHS.size, share).pvalue > LEAST_P
    assert stats.chisquare(counts[expected > 0]).pvalue > LEAST_P

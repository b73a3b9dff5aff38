"""The operon-GA (reconstruction OGA-R) as a whole."""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from sceann_hil.evolution import OGA, SGA, OGAConfig, OGAState, SGAConfig, State
from sceann_hil.evolution.oga import numbered_by_first_appearance
from sceann_hil.evolution.oga_options import (
    BitMutation,
    Deletion,
    Division,
    Duplication,
    FullList,
    InitialList,
    InitialOperons,
    Inversion,
    Order,
    Scope,
)

LEAST_P = 1e-4
NOTHING: dict[str, Any] = dict.fromkeys(("connection", "division", "duplication", "deletion", "inversion"), 0.0)


def assert_sound(state: OGAState, cap: int) -> None:
    population, length = state.genomes.shape
    assert state.values.shape == (population, length, cap)
    assert state.lengths.min() >= 1
    assert state.lengths.max() <= cap
    assert state.values.max() <= 1
    assert not np.any(state.values[np.arange(cap) >= state.lengths[:, :, None]])
    assert np.array_equal(state.genomes, state.values[:, :, 0])
    assert state.operons.shape == (population, length)
    for labels in state.operons:
        assert np.array_equal(labels, numbered_by_first_appearance(labels))


probabilities = st.sampled_from([0.0, 0.3, 1.0])
configs = st.builds(
    OGAConfig,
    population=st.just(6),
    connection=probabilities,
    division=probabilities,
    duplication=probabilities,
    deletion=probabilities,
    inversion=probabilities,
    cap=st.integers(1, 8),
    scope=st.sampled_from(Scope),
    initial_operons=st.sampled_from([InitialOperons.ONE, InitialOperons.SINGLETONS, InitialOperons.RANDOM]),
    initial_list=st.sampled_from(InitialList),
    full_list=st.sampled_from(FullList),
    duplicates=st.sampled_from(Duplication),
    deletes=st.sampled_from(Deletion),
    inverts=st.sampled_from(Inversion),
    bit_mutation=st.sampled_from(BitMutation),
    order=st.sampled_from(Order),
    divides=st.sampled_from(Division),
)


@settings(deadline=None, max_examples=150)
@given(configs, st.integers(1, 20), st.integers(0, 2**32))
def test_states_stay_sound_with_any_options(chosen: OGAConfig, genome_length: int, seed: int) -> None:
    algorithm = OGA(genome_length, chosen)
    rng = np.random.default_rng(seed)
    state = algorithm.start(rng)
    assert_sound(state, chosen.cap)
    for _ in range(8):
        state = algorithm.tell(state, state.genomes.sum(axis=1), rng)
        assert_sound(state, chosen.cap)


@settings(deadline=None, max_examples=60)
@given(configs, st.integers(1, 20), st.integers(0, 2**32))
def test_connection_division_and_duplication_never_change_what_is_expressed(
    chosen: OGAConfig, genome_length: int, seed: int
) -> None:
    neutral = chosen.model_copy(update={"mutation_rate": 0.0, "deletion": 0.0, "inversion": 0.0})
    algorithm = OGA(genome_length, neutral)
    rng = np.random.default_rng(seed)
    state = algorithm.start(rng)
    for _ in range(4):
        children = algorithm.tell(state, rng.random(6), rng)
        assert np.array_equal(children.genomes, state.genomes[children.parents])
        state = children


def test_without_its_five_operators_it_breeds_as_the_sga_does() -> None:
    fitness = np.array([2.0, 0.0, 1.0, 1.0])
    rng = np.random.default_rng(1)
    sga = SGA(3, SGAConfig(population=4, tournament=3, mutation_rate=0.2))
    oga = OGA(3, OGAConfig(population=4, tournament=3, mutation_rate=0.2, **NOTHING))
    oga_state = oga.start(rng)
    sga_state = State(oga_state.genomes, oga_state.parents)
    counts = np.zeros((2, 4, 8), dtype=int)
    for _ in range(4_000):
        for which, children in enumerate((sga.tell(sga_state, fitness, rng), oga.tell(oga_state, fitness, rng))):
            np.add.at(counts[which], (children.parents[1:], children.genomes[1:] @ [4, 2, 1]), 1)
    table = counts.reshape(2, -1)
    assert stats.chi2_contingency(table[:, table.sum(axis=0) > 0]).pvalue > LEAST_P


def test_without_its_five_operators_lists_and_operons_stay() -> None:
    algorithm = OGA(12, OGAConfig(**NOTHING, initial_operons=InitialOperons.RANDOM))
    rng = np.random.default_rng(2)
    state = algorithm.start(rng)
    children = algorithm.tell(state, rng.random(25), rng)
    assert children.lengths.max() == 1
    assert np.array_equal(children.operons, state.operons[children.parents])


def test_the_elite_keeps_its_lists_and_operons() -> None:
    algorithm = OGA(12, OGAConfig(mutation_rate=1.0))
    rng = np.random.default_rng(3)
    state = algorithm.start(rng)
    for _ in range(20):
        fitness = rng.random(25)
        elite = int(fitness.argmax())
        children = algorithm.tell(state, fitness, rng)
        assert np.array_equal(children.values[0], state.values[elite])
        assert np.array_equal(children.lengths[0], state.lengths[elite])
        assert np.array_equal(children.operons[0], state.operons[elite])
        state = children


@pytest.mark.parametrize(
    ("initial_operons", "parameter_loci", "expected"),
    [
        (InitialOperons.ONE, None, [0, 0, 0, 0, 0, 0]),
        (InitialOperons.SINGLETONS, None, [0, 1, 2, 3, 4, 5]),
        (InitialOperons.PER_PARAMETER, 2, [0, 0, 1, 1, 2, 2]),
    ],
)
def test_initial_operons(initial_operons: InitialOperons, parameter_loci: int | None, expected: list[int]) -> None:
    chosen = OGAConfig(initial_operons=initial_operons, parameter_loci=parameter_loci)
    state = OGA(6, chosen).start(np.random.default_rng(0))
    assert (state.operons == expected).all()


def test_random_initial_operons_differ_between_individuals() -> None:
    state = OGA(12, OGAConfig(initial_operons=InitialOperons.RANDOM)).start(np.random.default_rng(0))
    assert len({labels.tobytes() for labels in state.operons}) > 15


def test_initial_lists() -> None:
    rng = np.random.default_rng(0)
    states = {rule: OGA(40, OGAConfig(initial_list=rule)).start(rng) for rule in InitialList}
    assert {rule: set(state.lengths.ravel().tolist()) for rule, state in states.items()} == {
        InitialList.ONE_VALUE: {1},
        InitialList.EQUAL_COPIES: {6},
        InitialList.RANDOM_BITS: {6},
    }
    copies = states[InitialList.EQUAL_COPIES].values
    assert (copies == copies[:, :, :1]).all()
    random_bits = states[InitialList.RANDOM_BITS].values
    assert stats.binomtest(int(random_bits.sum()), random_bits.size).pvalue > LEAST_P
    assert stats.chisquare(random_bits.sum(axis=(0, 1))).pvalue > LEAST_P


def _children(**settings_: Any) -> OGAState:
    algorithm = OGA(16, OGAConfig(mutation_rate=1.0, elites=0, **(NOTHING | settings_)))
    rng = np.random.default_rng(4)
    return algorithm.tell(algorithm.start(rng), np.zeros(25), rng)


def test_bit_mutation_before_or_after_the_operators() -> None:
    after = _children(duplication=1.0, bit_mutation=BitMutation.EXPRESSED_ONLY)
    assert (after.values[:, :, 0] != after.values[:, :, 1]).all()
    before = _children(duplication=1.0, bit_mutation=BitMutation.EXPRESSED_ONLY, order=Order.MUTATION_FIRST)
    assert (before.values[:, :, 0] == before.values[:, :, 1]).all()


def test_duplication_comes_before_deletion_and_deletion_before_inversion() -> None:
    assert (_children(duplication=1.0, deletion=1.0).lengths == 1).all()
    operators = NOTHING | {"deletion": 1.0, "inversion": 1.0}
    algorithm = OGA(16, OGAConfig(mutation_rate=0.0, elites=0, **operators, initial_list=InitialList.RANDOM_BITS))
    rng = np.random.default_rng(6)
    state = algorithm.start(rng)
    children = algorithm.tell(state, np.zeros(25), rng)
    assert np.array_equal(children.values[:, :, :5], state.values[children.parents][:, :, :0:-1])


def test_an_operator_acts_on_whole_operons_unless_the_scope_is_per_locus() -> None:
    together = _children(duplication=0.5)
    assert (together.lengths == together.lengths[:, :1]).all()
    assert set(together.lengths[:, 0].tolist()) == {1, 2}
    apart = _children(duplication=0.5, scope=Scope.PER_LOCUS)
    assert stats.binomtest(int((apart.lengths == 2).sum()), apart.lengths.size).pvalue > LEAST_P
    assert (apart.lengths != apart.lengths[:, :1]).any(axis=1).all()


def test_fixed_lists_of_random_values_are_random_bits_without_deletion() -> None:
    algorithm = OGA(16, OGAConfig(initial_list=InitialList.RANDOM_BITS, deletion=0.0))
    rng = np.random.default_rng(5)
    state = algorithm.start(rng)
    for _ in range(10):
        state = algorithm.tell(state, state.genomes.sum(axis=1), rng)
        assert (state.lengths == 6).all()


GOLDEN = {
    "default": ({}, "98700188d2979faf86f4078b337e5501b880ca6bf0d8e259e322e945994561e7"),
    "other": (
        {
            "scope": "size_biased",
            "initial_operons": "random",
            "initial_list": "random_bits",
            "cap": 4,
            "full_list": "skip_operon",
            "duplicates": "head_to_tail",
            "deletes": "random_value",
            "inverts": "swap_head",
            "bit_mutation": "shared",
            "order": "mutation_first",
            "divides": "random_bipartition",
        },
        "e76b6cc1662d0f2a66ba940f8e1210257140ac63339d233a68878672e2510671",
    ),
}


@pytest.mark.parametrize("name", GOLDEN)
def test_a_seeded_run_is_the_one_we_know(name: str) -> None:
    settings_, sha256 = GOLDEN[name]
    algorithm = OGAConfig.model_validate(settings_).build(24)
    rng = np.random.default_rng(20_240_607)
    state = algorithm.start(rng)
    weights = np.arange(1.0, 25.0) % 7 - 2
    for _ in range(20):
        state = algorithm.tell(state, state.genomes @ weights, rng)
    assert hashlib.sha256(algorithm.dump(state)).hexdigest() == sha256

"""Codings: lengths of all paper sizes, and what every bit means."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sceann_hil.network.coding import MAX_SOURCES, Coding, NetworkSize, genome_from_hex, genome_to_hex

GOAL_REACH = [NetworkSize(n_s, n_h, 2) for n_s in (1, 2, 3, 5, 7) for n_h in (1, 2, 3, 4, 5)]
POLE_BALANCING = [NetworkSize(n_s, n_h, 1) for n_s in (2, 4) for n_h in (1, 2, 3, 4, 5)]

sizes = st.tuples(st.integers(1, 12), st.integers(0, 7), st.integers(1, 4)).map(lambda n: NetworkSize(*n))


@pytest.mark.parametrize("size", GOAL_REACH + POLE_BALANCING, ids=str)
def test_lengths_are_the_papers_formulas(size: NetworkSize) -> None:
    n_s, n_h, n_o = size.n_sensors, size.n_hidden, size.n_motors
    assert Coding.SCEANN1.genome_length(size) == (n_h + n_o) * (1 + n_s + n_h + n_o)
    assert Coding.SCEANN2.genome_length(size) == 2 * (n_h + n_o) * (n_s + n_h + n_o)
    assert Coding.SCEANN3.genome_length(size) == (n_h + n_o) * (n_s + n_h + n_o)


def test_the_paper_s_genomes_are_8_to_300_bits_long() -> None:
    lengths = [coding.genome_length(size) for coding in Coding for size in GOAL_REACH + POLE_BALANCING]
    assert min(lengths) == 8
    assert max(lengths) <= 300


def test_sceann1_has_one_sign_for_the_block_and_then_presences() -> None:
    size = NetworkSize(1, 1, 1)
    genome = [1, 1, 0, 1, 0, 0, 1, 1]
    assert Coding.SCEANN1.decode(np.array(genome), size).tolist() == [[1, 0, 1], [0, -1, -1]]


def test_sceann2_has_all_signs_of_the_block_and_then_all_presences() -> None:
    size = NetworkSize(1, 1, 1)
    genome = [1, 0, 1, 1, 1, 0, 0, 1, 0, 0, 1, 1]
    assert Coding.SCEANN2.decode(np.array(genome), size).tolist() == [[1, -1, 0], [0, 1, -1]]


def test_sceann3_has_one_sign_per_source() -> None:
    size = NetworkSize(1, 1, 1)
    assert Coding.SCEANN3.decode(np.array([1, 0, 1, 0, 1, 0]), size).tolist() == [[1, -1, 1], [-1, 1, -1]]


@pytest.mark.parametrize("coding", Coding)
def test_every_genome_of_a_small_network_decodes_and_encodes(coding: Coding) -> None:
    size = NetworkSize(1, 0, 1)
    length = coding.genome_length(size)
    genomes = ((np.arange(2**length)[:, None] >> np.arange(length)) & 1).astype(np.uint8)
    weights = coding.decode(genomes, size)
    assert np.array_equal(coding.decode(coding.encode(weights, size), size), weights)


@given(sizes.filter(lambda s: s.n_sources <= MAX_SOURCES), st.sampled_from(Coding), st.integers(0, 2**32 - 1))
def test_a_batch_decodes_like_its_genomes_one_by_one(size: NetworkSize, coding: Coding, seed: int) -> None:
    genomes = np.random.default_rng(seed).integers(0, 2, (3, coding.genome_length(size)), dtype=np.uint8)
    weights = coding.decode(genomes, size)
    assert weights.shape == (3, size.n_neurons, size.n_sources)
    assert all(np.array_equal(coding.decode(g, size), w) for g, w in zip(genomes, weights, strict=True))


@given(st.lists(st.integers(0, 1), min_size=1, max_size=300))
def test_hexadecimal_round_trip(bits: list[int]) -> None:
    assert genome_from_hex(genome_to_hex(np.array(bits)), len(bits)).tolist() == bits


def test_a_network_with_too_many_sources_is_refused() -> None:
    NetworkSize(20, 1, 2)
    with pytest.raises(ValueError, match=r"at most 23 sources.*got 20 \+ 2 \+ 2 = 24"):
        NetworkSize(20, 2, 2)


def test_a_genome_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(ValueError, match="expected 24 bits for sceann3"):
        Coding.SCEANN3.decode(np.zeros(23), NetworkSize(2, 3, 1))


def test_what_a_coding_cannot_express_is_refused() -> None:
    with pytest.raises(ValueError, match="sceann1 cannot express"):
        Coding.SCEANN1.encode(np.array([[1, -1]]), NetworkSize(1, 0, 1))
    with pytest.raises(ValueError, match="sceann3 cannot express"):
        Coding.SCEANN3.encode(np.array([[1, 0]]), NetworkSize(1, 0, 1))

"""The seed tree: streams that never meet and never depend on order."""

from __future__ import annotations

import numpy as np

from sceann_hil.seeds import Purpose, generator, keys, uniforms


def test_a_key_depends_on_its_own_numbers_only() -> None:
    grid = keys(7, Purpose.TRIAL, 3, np.arange(5)[:, None], np.arange(8), 0)
    assert grid.shape == (5, 8)
    assert keys(7, Purpose.TRIAL, 3, 4, 6, 0)[0] == grid[4, 6]


def test_keys_of_different_places_differ() -> None:
    some = keys(7, Purpose.TRIAL, np.arange(60)[:, None, None], np.arange(30)[:, None], np.arange(20)).ravel()
    other = [
        keys(8, Purpose.TRIAL, np.arange(60), 0, 0),
        keys(7, Purpose.START, np.arange(60), 0, 0),
        keys(7, Purpose.TRIAL, np.arange(60), 0, 0, 0),
    ]
    everything = np.concatenate([some, *other])
    assert len(np.unique(everything)) == len(everything)


def test_every_bit_of_a_key_is_fair() -> None:
    bits = np.unpackbits(keys(1, Purpose.TRIAL, np.arange(20_000)).view(np.uint8)).reshape(20_000, 64)
    assert np.abs(bits.mean(axis=0) - 0.5).max() < 5 * 0.5 / np.sqrt(20_000)


def test_the_keys_of_version_1_never_change() -> None:
    assert [f"{key:016x}" for key in keys(1, Purpose.TRIAL, [0, 1], 2, 3, 0)] == GOLDEN


GOLDEN = ["3b5353ce677578b7", "8ace8881d116d3f6"]


def test_uniforms_are_uniform_and_independent_of_their_number() -> None:
    some = keys(3, Purpose.TRIAL, np.arange(5_000))
    numbers = uniforms(some, 4)
    assert np.array_equal(uniforms(some, 2), numbers[:, :2])
    assert numbers.min() >= 0.0
    assert numbers.max() < 1.0
    assert np.abs(numbers.mean(axis=0) - 0.5).max() < 5 * np.sqrt(1 / 12 / 5_000)
    assert np.abs(np.corrcoef(numbers.T) - np.eye(4)).max() < 5 / np.sqrt(5_000)


def test_generators_of_different_streams_differ_and_repeat() -> None:
    assert generator(1, Purpose.ALGORITHM, 2).random() == generator(1, Purpose.ALGORITHM, 2).random()
    assert generator(1, Purpose.ALGORITHM, 2).random() != generator(1, Purpose.ALGORITHM, 3).random()

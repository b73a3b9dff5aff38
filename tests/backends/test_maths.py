"""Elementary functions and noise: as exact as they claim, and as random."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy import stats

from backends.simulation.maths import arctangent2, cosine, logarithm_of_mantissa, sine, wrap_angle
from backends.simulation.noise import CHANNELS, normal_pair, random_bits
from sceann_hil.network.compiled import compiled


def over(function: Callable[..., Any], *arrays: np.ndarray) -> np.ndarray:
    return np.array([function(*values) for values in zip(*(a.astype(np.float32) for a in arrays), strict=True)])


ANGLES = np.linspace(-np.pi, np.pi, 40_001).astype(np.float32)


def test_sine_and_cosine() -> None:
    assert np.abs(over(sine, ANGLES) - np.sin(ANGLES.astype(float))).max() < 6.1e-7
    assert np.abs(over(cosine, ANGLES) - np.cos(ANGLES.astype(float))).max() < 5e-7


def test_arctangent_in_all_quadrants_and_on_the_axes() -> None:
    for radius in (1e-3, 1.0, 100.0):
        x, y = (radius * np.cos(ANGLES)).astype(np.float32), (radius * np.sin(ANGLES)).astype(np.float32)
        error = over(arctangent2, y, x) - np.arctan2(y.astype(float), x.astype(float))
        assert np.abs((error + 1.0) % (2 * np.pi) - 1.0).max() < 4e-7
    zero, one = np.float32(0), np.float32(1)
    assert arctangent2(zero, zero) == 0
    assert [float(arctangent2(*v)) for v in ((zero, one), (one, zero), (zero, -one), (-one, zero))] == pytest.approx(
        [0, np.pi / 2, np.pi, -np.pi / 2], abs=1e-6
    )


def test_logarithm() -> None:
    q = np.linspace(0, 1, 20_001, endpoint=False).astype(np.float32)
    assert np.abs(over(logarithm_of_mantissa, q) - np.log1p(q.astype(float))).max() < 2e-7


def test_angles_are_wrapped_to_one_turn() -> None:
    angles = np.linspace(-60, 60, 5_001).astype(np.float32)
    wrapped = over(wrap_angle, angles)
    assert np.abs(wrapped).max() <= np.pi + 1e-5
    assert np.abs(np.sin(wrapped - angles.astype(float))).max() < 2e-5


@compiled
def _deviates(n_keys: int, n_steps: int) -> np.ndarray:
    numbers = np.empty((n_keys, n_steps, 2), np.float32)
    for key in range(n_keys):
        for step in range(n_steps):
            counter = np.uint32(step * CHANNELS)
            numbers[key, step, 0], numbers[key, step, 1] = normal_pair(
                np.uint32(key * 7919), np.uint32(1234567), counter
            )
    return numbers


def test_deviates_are_standard_normal_and_uncorrelated() -> None:
    numbers = _deviates(200, 500).astype(float)
    assert stats.kstest(numbers.ravel(), "norm").pvalue > 0.001
    assert abs(numbers.mean()) < 5 / np.sqrt(numbers.size)
    assert abs(numbers.std() - 1) < 5 / np.sqrt(2 * numbers.size)
    assert np.abs(numbers).max() > 4.0
    pairs = (
        (numbers[:, :, 0], numbers[:, :, 1]),
        (numbers[:, 1:, 0], numbers[:, :-1, 0]),
        (numbers[1:, :, 0], numbers[:-1, :, 0]),
    )
    for a, b in pairs:
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 5 / np.sqrt(a.size)
        assert abs(np.corrcoef(a.ravel() ** 2, b.ravel() ** 2)[0, 1]) < 5 / np.sqrt(a.size)


def test_every_bit_depends_on_key_and_counter() -> None:
    base = int(random_bits(np.uint32(1), np.uint32(2), np.uint32(3)))
    for other in ((2, 2, 3), (1, 3, 3), (1, 2, 4)):
        changed = bin(base ^ int(random_bits(*map(np.uint32, other)))).count("1")
        assert 6 <= changed <= 26

"""The seed tree: one root seed, and a stream of its own for everything that is random.

A stream is named by its purpose and by numbers such as generation, individual, trial and attempt. Nothing depends on
the order in which streams are used, so results are the same in a batch, on several threads, and after a resume.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


class Purpose(IntEnum):
    """What a stream is for. The numbers are part of the journal's meaning and never change."""

    ALGORITHM = 1
    START = 2
    TRIAL = 3
    ORDER = 4
    RUN = 5
    REFERENCE = 6
    REPEAT = 7
    ROBOT = 8
    ENSEMBLE = 9
    OBSTACLE = 10


def generator(root_seed: int, purpose: Purpose, *numbers: int) -> np.random.Generator:
    """A NumPy Generator for one stream of the tree."""
    sequence = np.random.SeedSequence(root_seed, spawn_key=(int(purpose), *numbers))
    return np.random.Generator(np.random.PCG64(sequence))


def keys(root_seed: int | NDArray[np.uint64], purpose: Purpose, *numbers: ArrayLike) -> NDArray[np.uint64]:
    """64-bit keys of many streams at once, for counter-based noise.

    Args:
        root_seed: the run's seed, 0 or more; an array of the seeds of several runs broadcasts like `numbers`.
        purpose: what the streams are for.
        numbers: arrays that broadcast against each other (generation, individual, trial, attempt).

    Returns:
        One key per element of the broadcast shape (at least one-dimensional), made by chaining the SplitMix64
        finaliser (Steele et al. 2014).
    """
    roots = np.array([root_seed % 2**64], dtype=np.uint64) if isinstance(root_seed, int) else root_seed
    key = _mix(roots)
    for number in (int(purpose), *numbers):
        key = _mix(key ^ np.asarray(number).astype(np.uint64))
    return key


def uniforms(stream_keys: NDArray[np.uint64], count: int) -> NDArray[np.float64]:
    """`count` numbers in [0, 1) from each key, float64, shape ``(n, count)``."""
    counters = np.arange(1, count + 1, dtype=np.uint64)
    bits = _mix(stream_keys[:, None] ^ _mix(counters)) >> np.uint64(11)
    return bits.astype(np.float64) * 2.0**-53


def _mix(z: NDArray[np.uint64]) -> NDArray[np.uint64]:
    with np.errstate(over="ignore"):
        z = z + _GOLDEN
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        return z ^ (z >> np.uint64(31))

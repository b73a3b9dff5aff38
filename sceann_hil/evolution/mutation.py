"""Bit mutation as an exact Bernoulli process, without one random number per bit."""

from __future__ import annotations

import math

import numpy as np

from sceann_hil.network.compiled import compiled

NEVER = 2.0**62
"""Farther than any genome reaches, and still an exact int64."""


@compiled
def bits_until_flip(rate: float, rng: np.random.Generator) -> int:
    """How many bits stay as they are before the next one flips.

    The gaps between the successes of independent trials are geometric, so walking from flip to flip gives the
    same distribution as asking every bit, with one draw per flip (inversion: ``floor(log(1-u) /
    log(1-rate))``).

    Args:
        rate: probability that a bit flips, 0 to 1.
        rng: advanced by one draw.
    """
    if rate <= 0.0:
        return int(NEVER)
    gap = math.log1p(-rng.random()) / math.log1p(-rate)
    return int(min(gap, NEVER))

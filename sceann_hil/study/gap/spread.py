"""How much one genome's fitness scatters, and how many trials it takes to tell two genomes apart."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from sceann_hil.study.statistics import LEVEL, POWER, mean_interval


@dataclass(frozen=True, slots=True)
class Spread:
    """Of n repeats of one genome.

    Attributes:
        n: repeats.
        mean: fitness.
        deviation: standard deviation of one repeat.
        low: lower end of the mean's 95 % interval (Student).
        high: upper end.
    """

    n: int
    mean: float
    deviation: float
    low: float
    high: float

    @classmethod
    def of(cls, fitness: NDArray[np.float64]) -> Spread:
        """From the fitness of every repeat, shape ``(n,)``, n at least 2."""
        n = len(fitness)
        if n < 2:
            raise ValueError(f"repeats: expected at least 2, got {n}")
        interval = mean_interval(fitness)
        return cls(n, interval.estimate, float(fitness.std(ddof=1)), interval.low, interval.high)

    def repeats_to_tell(self, difference: float) -> int:
        """Repeats of each of two genomes until a difference in fitness is seen with 80 % probability.

        Two-sided test at 5 %, normal approximation: ``2 ((z_.975 + z_.8) deviation / difference)^2``.
        """
        if difference <= 0.0:
            raise ValueError(f"difference: expected more than 0, got {difference}")
        z = float(stats.norm.ppf(0.5 + LEVEL / 2.0) + stats.norm.ppf(POWER))
        return max(1, math.ceil(2.0 * (z * self.deviation / difference) ** 2))

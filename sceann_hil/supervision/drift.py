"""Does the robot drift? One genome is run again every k trials, outside selection, and its fitness is watched.

The test: Kendall's rank correlation between time and fitness over all reference runs, two-sided. It needs no
assumption about the noise, and a battery that fades or a wheel that wears gives exactly such a trend.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

LEAST_RUNS = 6
SIGNIFICANCE = 0.01
"""Probability of a warning about a robot that does not drift, each time that it is asked."""


@dataclass(frozen=True, slots=True)
class Drift:
    """What the reference runs say.

    Attributes:
        runs: how many of them count.
        tau: Kendall's rank correlation of time and fitness, -1..1; 0 if there are too few.
        p_value: probability of such a correlation without drift.
        early: mean fitness of the first third.
        late: mean fitness of the last third.
    """

    runs: int
    tau: float
    p_value: float
    early: float
    late: float

    @classmethod
    def of(cls, fitness: Sequence[float]) -> Drift:
        """From the fitness of reference runs in order."""
        # SciPy takes a third of a second to import, and most runs need none of it.
        from scipy.stats import kendalltau

        n = len(fitness)
        third = max(1, n // 3)
        early, late = (float(np.mean(part)) if n else 0.0 for part in (fitness[:third], fitness[-third:]))
        if n < LEAST_RUNS or min(fitness) == max(fitness):
            return cls(n, 0.0, 1.0, early, late)
        found = kendalltau(np.arange(n), fitness)
        return cls(n, float(found.statistic), float(found.pvalue), early, late)

    @property
    def warning(self) -> str | None:
        """What to tell a person; None if there is nothing to tell."""
        if self.p_value >= SIGNIFICANCE:
            return None
        return (
            f"the robot drifts: over {self.runs} runs the reference genome went from fitness {self.early:.3g} to "
            f"{self.late:.3g} (p = {self.p_value:.1g})"
        )

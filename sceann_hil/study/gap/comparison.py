"""Two measurements of the same genomes side by side."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy import stats

from sceann_hil.robot import GapEstimate
from sceann_hil.run.measuring import Measurement

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class GenomeGap:
    """One genome here and there.

    Attributes:
        genome: hexadecimal.
        simulated: mean fitness in simulation.
        measured: mean fitness on the robot.
        gap: measured minus simulated.
        low: lower end of the gap's 95 % interval (Welch); not a number with a single repeat.
        high: upper end.
    """

    genome: str
    simulated: float
    measured: float
    gap: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class GapReport:
    """What the comparison says.

    Attributes:
        simulation: name of the simulated robot.
        robot: name of the other one.
        genomes: one by one.
        rank_correlation: Spearman's, over genomes; not a number with fewer than three, or without differences.
        p_value: of no correlation.
        estimate: gap parameters that make the simulation behave like the robot; None if there are no traces.
    """

    simulation: str
    robot: str
    genomes: tuple[GenomeGap, ...]
    rank_correlation: float
    p_value: float
    estimate: GapEstimate | None

    @classmethod
    def of(
        cls, genomes: list[str], simulated: Measurement, measured: Measurement, estimate: GapEstimate | None
    ) -> GapReport:
        """Compare; both measurements are of the same genomes in the same order."""
        here, there = simulated.repeats, measured.repeats
        gaps = tuple(_gap(genome, a, b) for genome, a, b in zip(genomes, here, there, strict=True))
        means = here.mean(axis=1), there.mean(axis=1)
        varied = len(genomes) > 2 and all(np.ptp(mean) > 0 for mean in means)
        rank = stats.spearmanr(*means) if varied else None
        return cls(
            simulated.robot,
            measured.robot,
            gaps,
            float(rank.statistic) if rank is not None else float("nan"),
            float(rank.pvalue) if rank is not None else float("nan"),
            estimate,
        )

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def _gap(genome: str, simulated: np.ndarray[Any, Any], measured: np.ndarray[Any, Any]) -> GenomeGap:
    gap = float(measured.mean() - simulated.mean())
    low = high = float("nan")
    n, m = len(measured), len(simulated)
    if n > 1 and m > 1:
        parts = measured.var(ddof=1) / n, simulated.var(ddof=1) / m
        error = float(np.sqrt(sum(parts)))
        if error > 0.0:
            freedom = sum(parts) ** 2 / (parts[0] ** 2 / (n - 1) + parts[1] ** 2 / (m - 1))
            half = float(stats.t.ppf((1 + CONFIDENCE) / 2, freedom)) * error
        else:
            half = 0.0
        low, high = gap - half, gap + half
    return GenomeGap(genome, float(simulated.mean()), float(measured.mean()), gap, low, high)

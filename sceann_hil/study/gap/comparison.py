"""Two measurements of the same genomes side by side."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from sceann_hil.robot import GapEstimate
from sceann_hil.run.measuring import Measurement
from sceann_hil.study.statistics import contrast


@dataclass(frozen=True, slots=True)
class GenomeGap:
    """One genome here and there.

    Attributes:
        genome: hexadecimal.
        simulated: mean fitness in simulation.
        measured: mean fitness on the robot.
        gap: measured minus simulated.
        low: lower end of the gap's 95 % interval (Welch); None with a single repeat.
        high: upper end.
    """

    genome: str
    simulated: float
    measured: float
    gap: float
    low: float | None
    high: float | None


@dataclass(frozen=True, slots=True)
class GapReport:
    """What the comparison says.

    Attributes:
        simulation: name of the simulated robot.
        robot: name of the other one.
        genomes: one by one.
        rank_correlation: Spearman's, over genomes; None with fewer than three, or without differences.
        p_value: of no correlation; None without one.
        estimate: gap parameters that make the simulation behave like the robot; None if there are no traces.
    """

    simulation: str
    robot: str
    genomes: tuple[GenomeGap, ...]
    rank_correlation: float | None
    p_value: float | None
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
            float(rank.statistic) if rank is not None else None,
            float(rank.pvalue) if rank is not None else None,
            estimate,
        )

    def as_dict(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


def _gap(genome: str, simulated: NDArray[np.float64], measured: NDArray[np.float64]) -> GenomeGap:
    means = float(simulated.mean()), float(measured.mean())
    if min(len(simulated), len(measured)) < 2:
        return GenomeGap(genome, *means, means[1] - means[0], None, None)
    found = contrast({"here": simulated, "there": measured}, {"there": 1.0, "here": -1.0})
    return GenomeGap(genome, *means, found.estimate, found.low, found.high)

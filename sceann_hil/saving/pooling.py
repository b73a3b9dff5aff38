"""Identical genomes share what was measured of any of them.

The policy, in full: a genome's fitness is the mean, trial by trial, over all counted attempts that the run made of it,
in this generation and before; once a trial has as many counted attempts as the limit says, no more of it are made.
With a limit of 1 on a noise-free task this changes nothing but the time: every attempt would give the same. On a noisy
task it changes the numbers in one direction only: less noise, above all for the elite, whose lucky first evaluation is
averaged with later ones instead of being kept.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.coding import Bits


class Pool:
    """Sums over counted attempts of each genome.

    Args:
        n_trials: trials of an individual.
        limit: counted attempts of each trial of a genome after which no more are made.
    """

    def __init__(self, n_trials: int, limit: int) -> None:
        self._n_trials = n_trials
        self._limit = limit
        self._sums: dict[bytes, NDArray[np.float64]] = {}

    def add(self, genome: bytes, trial: int, fitness: float, succeeded: bool) -> None:
        """One counted attempt of a genome (its bits as bytes)."""
        sums = self._sums.setdefault(genome, np.zeros((3, self._n_trials)))
        sums[:, trial] += (1.0, fitness, float(succeeded))

    def counts(self, genome: bytes) -> NDArray[np.float64]:
        """Counted attempts of each trial, shape ``(n_trials,)``."""
        sums = self._sums.get(genome)
        return np.zeros(self._n_trials) if sums is None else sums[0]

    def wanted(self, genomes: Bits) -> NDArray[np.bool_]:
        """Which trials of a generation are run; of identical individuals the first ones are.

        Args:
            genomes: bits, shape ``(population, L)``.

        Returns:
            Shape ``(population, n_trials)``; it depends on what was added before, so ask once per generation.
        """
        planned: dict[bytes, NDArray[np.float64]] = {}
        wanted = np.zeros((len(genomes), self._n_trials), np.bool_)
        for individual, genome in enumerate(genomes):
            have = planned.setdefault(genome.tobytes(), self.counts(genome.tobytes()).copy())
            wanted[individual] = have < self._limit
            have += wanted[individual]
        return wanted

    def means(self, genomes: Bits) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pooled fitness and success rate of every trial, shape ``(population, n_trials)``; NaN without any attempt."""
        sums = np.stack([self._sums.get(g.tobytes(), np.zeros((3, self._n_trials))) for g in genomes])
        with np.errstate(invalid="ignore"):
            return sums[:, 1] / sums[:, 0], sums[:, 2] / sums[:, 0]

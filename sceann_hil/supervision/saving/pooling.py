"""Identical genomes share what was measured of any of them.

The policy, in full: a genome's fitness is the mean, trial by trial, over all counted attempts that the run made of it,
in this generation and before; once a trial has as many counted attempts as the limit says, no more of it are made. With
a limit of 1 on a noise-free task this changes nothing but the time: every attempt would give the same. On a noisy task
the best of what is known is run once more in every generation that it is part of, whatever the limit: it may be the
best by luck, and without that its luck would stay in the population for good.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Bits


class Pool:
    """Sums over counted attempts of each genome.

    Args:
        n_trials: trials of an individual.
        limit: counted attempts of each trial of a genome after which no more are made.
        noisy: another attempt may give another result, so the best known genome of a generation is run again.
    """

    def __init__(self, n_trials: int, limit: int, *, noisy: bool) -> None:
        self._n_trials = n_trials
        self._limit = limit
        self._noisy = noisy
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
        if self._noisy:
            known = np.nan_to_num(self.means(genomes)[0].mean(axis=1), nan=-np.inf)
            best = int(known.argmax())
            wanted[best] |= np.isfinite(known[best])
        return wanted

    def means(self, genomes: Bits) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pooled fitness and success rate of every trial, shape ``(population, n_trials)``; NaN without any attempt."""
        sums = np.stack([self._sums.get(g.tobytes(), np.zeros((3, self._n_trials))) for g in genomes])
        with np.errstate(invalid="ignore"):
            return sums[:, 1] / sums[:, 0], sums[:, 2] / sums[:, 0]

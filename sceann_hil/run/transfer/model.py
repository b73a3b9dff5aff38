"""What a few trials on one robot say of every candidate: a linear-Gaussian model whose kernel is the ensemble.

Fitness of candidate k in start h on the unknown robot is ``mu[k, h] + A[k, h] z + d[k] + e``. `mu` is the ensemble's
mean, ``A = (F - mu) / sqrt(M)`` its M deviations; ``z ~ N(0, I)`` says which mixture of its robots this one resembles,
``d[k] ~ N(0, tau^2)`` what no robot of the ensemble says of this candidate, ``e ~ N(0, s^2)`` is one trial's noise.
tau and s are not set: their marginal likelihood is computed on a grid from the trials themselves, and the posterior is
averaged over it. Everything else is the algebra of Gaussian processes (Rasmussen and Williams 2006, Eq. 2.23 to 2.26),
with systems no larger than the number of trials.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Float64Array = NDArray[np.float64]

DISCREPANCIES = (0.08, 0.16, 0.32, 0.64, 1.28)
"""tau on the grid, in units of the ensemble's spread."""
NOISES = (0.2, 0.35, 0.6, 1.0, 1.6)
"""s on the grid, in units of the ensemble's spread."""
_USUAL = (0.32, 0.7)
_DECADES = (0.7, 0.6)
"""Before any trial: tau and s about `_USUAL`, log-normal with these deviations."""
_LEAST_WEIGHT = 0.03


@dataclass(frozen=True, slots=True)
class Observations:
    """n trials on the robot, in their order.

    Attributes:
        candidate: int64, shape ``(n,)``.
        start: index of the start, int64, shape ``(n,)``.
        value: fitness, float64, shape ``(n,)``.
        operator_s: time that a person needed for it, float64, shape ``(n,)``.
    """

    candidate: NDArray[np.int64]
    start: NDArray[np.int64]
    value: Float64Array
    operator_s: Float64Array

    @classmethod
    def of(
        cls,
        candidate: NDArray[np.int64],
        start: NDArray[np.int64],
        value: Float64Array,
        operator_s: Float64Array | None = None,
    ) -> Observations:
        """Of trials beside which nobody needed any time, unless it is given."""
        return cls(candidate, start, value, np.zeros(len(candidate)) if operator_s is None else operator_s)

    def and_one(self, candidate: int, start: int, value: float, operator_s: float = 0.0) -> Observations:
        """With one more trial."""
        return Observations(
            np.append(self.candidate, candidate),
            np.append(self.start, start),
            np.append(self.value, value),
            np.append(self.operator_s, operator_s),
        )

    def expected_operator_s(self, n_starts: int) -> Float64Array:
        """Time that a person is expected to need for a trial from each start, shape ``(n_starts,)``.

        The mean over its trials and one that took as long as all of them on average: one slow trial proves little.
        """
        if not len(self):
            return np.zeros(n_starts)
        sums = np.bincount(self.start, self.operator_s, n_starts)
        return np.asarray((sums + self.operator_s.mean()) / (np.bincount(self.start, minlength=n_starts) + 1.0))

    def __len__(self) -> int:
        return len(self.candidate)


NOTHING = Observations.of(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))
"""Before the first trial."""


@dataclass(frozen=True, slots=True)
class Posterior:
    """What is known of the K candidates' mean fitness over all starts.

    Attributes:
        mean: shape ``(K,)``.
        deviation: standard deviation, shape ``(K,)``.
        discrepancy: most likely tau.
        noise: most likely s.
    """

    mean: Float64Array
    deviation: Float64Array
    discrepancy: float
    noise: float

    @property
    def best(self) -> int:
        """The candidate to recommend."""
        return int(self.mean.argmax())


class Model:
    """The prior; conditioned on trials by `condition`.

    Args:
        fitness: of the ensemble, shape ``(M, K, H)``.
        least_spread: the ensemble's spread is taken to be at least this much.
    """

    def __init__(self, fitness: NDArray[np.float32], least_spread: float) -> None:
        n_robots = len(fitness)
        self.mu: Float64Array = fitness.mean(axis=0, dtype=np.float64)
        deviations = (fitness - self.mu.astype(np.float32)) / np.float32(np.sqrt(n_robots))
        self.a: NDArray[np.float32] = np.ascontiguousarray(deviations.transpose(1, 2, 0))
        """Shape ``(K, H, M)``."""
        self.b: Float64Array = self.a.mean(axis=1, dtype=np.float64)
        """The same for means over starts, shape ``(K, M)``."""
        self.spread = max(float(np.sqrt((self.a.astype(np.float64) ** 2).sum(axis=2).mean())), least_spread)

    def condition(self, observed: Observations) -> Conditioned:
        """The model after these trials."""
        return Conditioned(self, observed)


class Conditioned:
    """The model after n trials. Computed when asked for; a few milliseconds."""

    def __init__(self, model: Model, observed: Observations) -> None:
        self.model = model
        self.observed = observed
        rows = model.a[observed.candidate, observed.start].astype(np.float64)
        self._rows = rows
        self._residual = observed.value - model.mu[observed.candidate, observed.start]
        self._same = observed.candidate[:, None] == observed.candidate[None, :]
        self._gram = rows @ rows.T
        self._cross = model.b @ rows.T
        self._own = (np.arange(len(model.b))[:, None] == observed.candidate).astype(np.float64)
        self._grid = [(tau * model.spread, s * model.spread) for tau in DISCREPANCIES for s in NOISES]
        logs = np.array([self._log_likelihood(tau, s) for tau, s in self._grid])
        weights = np.exp(logs - logs.max())
        self._weights = weights / weights.sum()

    def _whitening(self, tau: float, s: float) -> Float64Array:
        """W with W C W^T = I for the trials' covariance C, shape ``(n, n)``; C^-1 is W^T W. Systems are small."""
        covariance = self._gram + tau**2 * self._same + s**2 * np.eye(len(self.observed))
        return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), np.float64)

    def _log_likelihood(self, tau: float, s: float) -> float:
        relative = np.log(np.array([tau, s]) / self.model.spread / np.array(_USUAL)) / np.array(_DECADES)
        prior = float(-0.5 * (relative**2).sum())
        if not len(self.observed):
            return prior
        whitening = self._whitening(tau, s)
        fit = float(((whitening @ self._residual) ** 2).sum())
        return prior - 0.5 * fit + float(np.log(np.diag(whitening)).sum())

    @property
    def likeliest(self) -> tuple[float, float]:
        """Most likely (tau, s)."""
        return self._grid[int(self._weights.argmax())]

    @cached_property
    def posterior(self) -> Posterior:
        """Of every candidate, averaged over tau and s."""
        mean, square = np.zeros(len(self.model.b)), np.zeros(len(self.model.b))
        used = np.flatnonzero(self._weights > _LEAST_WEIGHT)
        for place in used.tolist():
            weight = self._weights[place] / self._weights[used].sum()
            one, variance = self._given(*self._grid[place])
            mean += weight * one
            square += weight * (variance + one**2)
        deviation = np.sqrt(np.maximum(square - mean**2, 1e-12))
        return Posterior(mean, deviation, *self.likeliest)

    def _given(self, tau: float, s: float) -> tuple[Float64Array, Float64Array]:
        """Mean and variance of every candidate's mean fitness, for one tau and s."""
        model = self.model
        mean = model.mu.mean(axis=1)
        variance = (model.b**2).sum(axis=1) + tau**2
        if not len(self.observed):
            return mean, variance
        whitening = self._whitening(tau, s)
        cross = self._cross + tau**2 * self._own
        whitened = cross @ whitening.T
        mean = mean + whitened @ (whitening @ self._residual)
        variance = variance - (whitened**2).sum(axis=1)
        return mean, np.maximum(variance, 1e-12)

    def covariance(self, candidates: NDArray[np.int64], options: NDArray[np.int64]) -> Float64Array:
        """Posterior covariance of candidates' means with single trials, at the most likely tau and s.

        Args:
            candidates: c of them.
            options: candidates of the trials, o of them.

        Returns:
            Shape ``(c, o, H)``: without the trial's noise.
        """
        model = self.model
        tau, s = self.likeliest
        rows = model.a[options].astype(np.float64)
        o, h, m = rows.shape
        covariance = np.einsum("cm,ohm->coh", model.b[candidates], rows, optimize=True)
        covariance += tau**2 * (candidates[:, None] == options)[:, :, None]
        if len(self.observed):
            whitening = self._whitening(tau, s)
            left = model.b[candidates] @ self._rows.T + tau**2 * (candidates[:, None] == self.observed.candidate)
            right = (rows.reshape(o * h, m) @ self._rows.T).reshape(o, h, -1)
            right = right + tau**2 * (options[:, None] == self.observed.candidate)[:, None, :]
            solved = (right.reshape(o * h, -1) @ whitening.T) @ whitening
            covariance -= (left @ solved.T).reshape(len(candidates), o, h)
        return np.asarray(covariance, np.float64)

    def trial_variance(self, options: NDArray[np.int64]) -> Float64Array:
        """Posterior variance of single trials without their noise, at the most likely tau and s, shape ``(o, H)``."""
        tau, s = self.likeliest
        rows = self.model.a[options].astype(np.float64)
        variance = (rows**2).sum(axis=2) + tau**2
        if len(self.observed):
            o, h, m = rows.shape
            right = (rows.reshape(o * h, m) @ self._rows.T).reshape(o, h, -1)
            right = (right + tau**2 * (options[:, None] == self.observed.candidate)[:, None, :]).reshape(o * h, -1)
            variance = variance - ((right @ self._whitening(tau, s).T) ** 2).sum(axis=1).reshape(o, h)
        return np.asarray(np.maximum(variance, 1e-12))

    @cached_property
    def mixture(self) -> tuple[Float64Array, Float64Array]:
        """Posterior mean of z, shape ``(M,)``, and its covariance, shape ``(M, M)``, at the most likely tau and s."""
        n_robots = self.model.a.shape[2]
        if not len(self.observed):
            return np.zeros(n_robots), np.eye(n_robots)
        whitening = self._whitening(*self.likeliest)
        rows = whitening @ self._rows
        return rows.T @ (whitening @ self._residual), np.eye(n_robots) - rows.T @ rows

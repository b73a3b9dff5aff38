"""Which trial to do next: the one that is expected to raise the recommended controller's fitness the most.

That is the knowledge gradient (Frazier, Powell and Dayanik 2009). One trial alone may change no decision although a few
would, so a candidate is also looked at with a trial from every start, and what these bring together is divided by their
number: the KG(*) policy (Frazier and Powell 2010). The same number says when it is enough.
"""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from sceann_hil.run.transfer.model import Conditioned, Observations

OPTIONS = 30
"""Candidates that may be tried next: those with the highest mean + `_OPTIMISM` standard deviations."""
RIVALS = 200
"""Candidates that may be recommended afterwards, by the same order."""
INDIFFERENT = 0.9
"""Starts that bring so much of what the best start brings are as good: the cheapest of them is taken."""
_OPTIMISM = 1.5
_QUANTILES = tuple(NormalDist().inv_cdf((i + 0.5) / 33) for i in range(33))
"""Of the standard normal distribution: what a trial may turn out to say."""


@dataclass(frozen=True, slots=True)
class Choice:
    """The next trial.

    Attributes:
        candidate: its controller.
        start: index of its start.
        gain: by how much a trial is expected to raise the fitness of what is recommended.
    """

    candidate: int
    start: int
    gain: float


def choose(known: Conditioned, costs_s: NDArray[np.float64]) -> Choice:
    """The next trial.

    Args:
        known: the model after the trials so far.
        costs_s: robot time that a trial of each candidate from each start is expected to take, shape ``(K, H)``.
            What a person beside it needs is expected from the trials so far.
    """
    posterior = known.posterior
    order = np.argsort(-(posterior.mean + _OPTIMISM * posterior.deviation), kind="stable")
    rivals = _with(order[:RIVALS], posterior.best)
    options = _with(order[:OPTIONS], posterior.best)
    covariance = known.covariance(rivals, options)
    n_starts = covariance.shape[2]
    noise = known.likeliest[1] ** 2
    mean, best = posterior.mean[rivals], float(posterior.mean.max())

    one = _gain(mean, best, covariance / np.sqrt(known.trial_variance(options) + noise))
    together = covariance.mean(axis=2)
    own = together[np.searchsorted(rivals, options), np.arange(len(options))]
    all_starts = _gain(mean, best, (together / np.sqrt(np.maximum(own, 1e-12) + noise / n_starts))[:, :, None])[:, 0]

    gains = np.maximum(one.max(axis=1), all_starts / n_starts)
    place = int(gains.argmax())
    candidate = int(options[place])
    cost_s = costs_s[candidate] + known.observed.expected_operator_s(n_starts)
    return Choice(candidate, _start(one[place], candidate, known.observed, cost_s), max(0.0, float(gains[place])))


def _with(candidates: NDArray[np.int64], one: int) -> NDArray[np.int64]:
    return np.unique(np.append(candidates, one))


def _gain(mean: NDArray[np.float64], best: float, slopes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Expected rise of the largest mean, if means move by `slopes` (shape ``(c, o, h)``) times a normal deviate."""
    gain = np.zeros(slopes.shape[1:])
    for deviate in _QUANTILES:
        gain += (mean[:, None, None] + slopes * deviate).max(axis=0)
    return gain / len(_QUANTILES) - best


def _start(gains: NDArray[np.float64], candidate: int, observed: Observations, cost_s: NDArray[np.float64]) -> int:
    """The cheapest of the starts that this candidate was tried from least often and that bring about as much."""
    tried = np.bincount(observed.start[observed.candidate == candidate], minlength=len(gains))
    least = tried == tried.min()
    best = float(gains[least].max())
    good = least & (gains >= INDIFFERENT * best if best > 0.0 else np.ones_like(least))
    places = np.flatnonzero(good)
    return int(places[cost_s[places].argmin()])

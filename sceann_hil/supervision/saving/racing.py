"""Racing: no more trials for an individual whose rank in the generation is settled.

**The exact rule and its proof.** Every trial's fitness lies in ``[worst, best]``, so an individual's mean fitness lies
in an interval ``[low, high]`` that shrinks with every trial. Its race is over when its interval is a point, or meets no
other individual's interval: for every other individual j either ``high_i < low_j`` or ``low_i > high_j``.

*Claim*: whatever the trials that were left out would have given, the next generation is the same.
*Proof.* Let f be the fitnesses after all trials, and g those that are reported, with ``g_i = f_i`` where all trials
were run and any number in ``[low_i, high_i]`` otherwise (`raced_fitness` takes the middle). Take two individuals i
and j. If both ran all trials, ``(g_i, g_j) = (f_i, f_j)``. Otherwise one of them, say i, was ended. At that moment its
interval met no other; intervals only shrink, so those of i and j never meet again, and both ``(f_i, f_j)`` and
``(g_i, g_j)`` are one number of each: ``g_i < g_j`` exactly if ``f_i < f_j``, and neither pair is a tie. So f and g
have the same order and the same ties. The algorithms of this package (tournaments and elites in
`sceann_hil.evolution.selection`) use fitness only in comparisons ``>`` and ``==`` between individuals, and draw random
numbers that depend on nothing else; hence they do the same with g as with f. QED.

Whoever may still be the best runs all trials, so that a generation's best fitness is always measured; the numbers
reported for ended individuals are not their fitness, and an algorithm that uses more than comparisons must not be
raced. The claim is about one generation: with pooling on, later means are taken over other attempts.

**The approximate rule** may change the selection. What is known of a generation is read as an individual's worth plus a
trial's easiness plus noise (`_additive`), so that whoever ran only some trials can be compared with who ran others. An
individual's race ends also when, after half of its trials, its expected mean plus one standard error (of the trials
that are left) is below the median of all. It stays in the population with that mean as its fitness, so a wrong decision
does not remove anybody: it only ranks the lower half by fewer trials.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.supervision.saving.settings import Racing

_SWEEPS = 6
"""Of `_additive`; the two parts hardly depend on each other, so it settles at once."""


def bounds(values: NDArray[np.float64], worst: float, best: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What the mean fitness of each individual can still be.

    Args:
        values: fitness of each trial, NaN where it is not known, shape ``(population, n_trials)``.
        worst: no trial is worth less.
        best: no trial is worth more.

    Returns:
        Smallest and largest mean, shape ``(population,)``.
    """
    known = ~np.isnan(values)
    n_trials = values.shape[1]
    total = np.where(known, values, 0.0).sum(axis=1)
    left = n_trials - known.sum(axis=1)
    return (total + left * worst) / n_trials, (total + left * best) / n_trials


def still_open(values: NDArray[np.float64], worst: float, best: float, rule: Racing) -> NDArray[np.bool_]:
    """Whose trials must go on, shape ``(population,)``.

    Args:
        values: fitness of each trial, NaN where it is not known, shape ``(population, n_trials)``.
        worst: no trial is worth less.
        best: no trial is worth more.
        rule: exact or approximate; see the module.
    """
    low, high = bounds(values, worst, best)
    # a hair of slack: the mean is rounded, and a tie must stay a tie
    slack = 1e-12 * np.maximum(np.abs(low), np.abs(high))
    meets = (low[:, None] - slack[:, None] <= high[None, :] + slack[None, :]) & (
        low[None, :] - slack[None, :] <= high[:, None] + slack[:, None]
    )
    np.fill_diagonal(meets, False)
    unfinished: NDArray[np.bool_] = np.asarray(np.isnan(values).any(axis=1))
    is_open = unfinished & (meets.any(axis=1) | (high >= low.max()))
    if rule is Racing.APPROXIMATE:
        is_open &= ~_is_behind(values, worst, best)
    return np.asarray(is_open)


def _additive(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the least-squares sum of an individual's worth and a trial's easiness says of every trial.

    Args:
        values: fitness of each trial, NaN where it is not known, shape ``(population, n_trials)``.

    Returns:
        The same shape, without gaps; a trial that nobody ran is as easy as the mean of the others.
    """
    known = ~np.isnan(values)
    given = np.where(known, values, 0.0)
    of_individual, of_trial = np.maximum(known.sum(axis=1), 1), np.maximum(known.sum(axis=0), 1)
    easiness = np.zeros(values.shape[1])
    worth = np.zeros(len(values))
    for _ in range(_SWEEPS):
        worth = (given - known * easiness).sum(axis=1) / of_individual
        easiness = (given - known * worth[:, None]).sum(axis=0) / of_trial
    return np.asarray(worth[:, None] + easiness)


def _expected(
    values: NDArray[np.float64], model: NDArray[np.float64], worst: float, best: float
) -> NDArray[np.float64]:
    """Mean of each individual over all trials, with `_additive`'s `model` where one was not run, ``(population,)``."""
    filled = np.where(np.isnan(values), np.clip(model, worst, best), values)
    return np.asarray(filled.mean(axis=1), np.float64)


def _is_behind(values: NDArray[np.float64], worst: float, best: float) -> NDArray[np.bool_]:
    """Who is in the lower half and will hardly leave it, by the approximate rule."""
    known = ~np.isnan(values)
    count, n_trials = known.sum(axis=1), values.shape[1]
    enough = count >= max(2, -(-n_trials // 2))
    if not enough.any() or not count.all():
        return np.zeros(len(values), np.bool_)
    model = _additive(values)
    mean = _expected(values, model, worst, best)
    residual = np.where(known, values - model, 0.0)
    variance = (residual**2).sum() / max(int(known.sum()) - len(values) - int(known.any(axis=0).sum()) + 1, 1)
    error = np.sqrt(variance * (1.0 / count - 1.0 / n_trials))
    return np.asarray(enough & (mean + error < np.median(mean)))


def raced_fitness(values: NDArray[np.float64], worst: float, best: float, rule: Racing) -> NDArray[np.float64]:
    """Fitness of all individuals after a race, shape ``(population,)``: the mean over all trials, where they were run.

    Who was ended gets the middle of what its mean can still be (exact), or the mean that is expected (approximate).
    """
    complete: NDArray[np.bool_] = np.asarray(~np.isnan(values).any(axis=1))
    if rule is Racing.APPROXIMATE:
        ended = _expected(values, _additive(values), worst, best)
    else:
        low, high = bounds(values, worst, best)
        ended = (low + high) / 2.0
    whole = np.where(complete[:, None], values, 0.0).mean(axis=1)
    return np.asarray(np.where(complete, whole, ended), np.float64)

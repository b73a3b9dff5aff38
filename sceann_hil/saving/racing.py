"""Racing: no more trials for an individual whose rank in the generation is settled.

**The exact rule and its proof.** Every trial's fitness lies in ``[worst, best]``, so an individual's mean fitness lies
in an interval ``[low, high]`` that shrinks with every trial. Its race is over when its interval is a point, or meets no
other individual's interval: for every other individual j either ``high_i < low_j`` or ``low_i > high_j``.

*Claim*: whatever the trials that were left out would have given, the next generation is the same.
*Proof.* Let f be the fitnesses after all trials, and g those that are reported, with ``g_i = f_i`` where all trials
were run and any number in ``[low_i, high_i]`` otherwise (`censored_fitness` takes the middle). Take two individuals i
and j. If both ran all trials, ``(g_i, g_j) = (f_i, f_j)``. Otherwise one of them, say i, was ended. At that moment its
interval met no other; intervals only shrink, so those of i and j never meet again, and both ``(f_i, f_j)`` and
``(g_i, g_j)`` are one number of each: ``g_i < g_j`` exactly if ``f_i < f_j``, and neither pair is a tie. So f and g
have the same order and the same ties. The algorithms of this package (tournaments and elites in
`sceann_hil.evolution.selection`) use fitness only in comparisons ``>`` and ``==`` between individuals, and draw random
numbers that depend on nothing else; hence they do the same with g as with f. QED.

Whoever may still be the best runs all trials, so that a generation's best fitness is always measured; the numbers
reported for ended individuals are not their fitness, and an algorithm that uses more than comparisons must not be
raced. The claim is about one generation: with pooling on, later means are taken over other attempts.

**The approximate rule** may change the selection. An individual with b others that are certainly better (``low_j >
high_i``) wins a tournament of k among n only if it is drawn and no contestant is one of the b. Its race ends also when
the expected number of its children, ``(n - elites)`` times the probability that it wins, is below `LEAST_CHILDREN`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.saving.settings import Racing

LEAST_CHILDREN = 0.2
"""Expected children below which the approximate rule gives an individual up."""


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


def still_open(
    low: NDArray[np.float64], high: NDArray[np.float64], rule: Racing, *, tournament: int, elites: int
) -> NDArray[np.bool_]:
    """Whose trials must go on, shape ``(population,)``.

    Args:
        low: smallest possible fitness of each individual.
        high: largest possible one.
        rule: exact or approximate; see the module.
        tournament: contestants, for the approximate rule.
        elites: individuals that enter the next generation as they are.
    """
    n = len(low)
    # a hair of slack: the mean is rounded, and a tie must stay a tie
    slack = 1e-12 * np.maximum(np.abs(low), np.abs(high))
    meets = (low[:, None] - slack[:, None] <= high[None, :] + slack[None, :]) & (
        low[None, :] - slack[None, :] <= high[:, None] + slack[:, None]
    )
    np.fill_diagonal(meets, False)
    unfinished = high > low
    is_open = unfinished & meets.any(axis=1)
    if rule is Racing.APPROXIMATE:
        better = (low[None, :] > high[:, None]).sum(axis=1)
        wins = ((n - better) / n) ** tournament - ((n - better - 1) / n) ** tournament
        is_open &= ~((better >= max(elites, 1)) & ((n - elites) * wins < LEAST_CHILDREN))
    return np.asarray(is_open | (unfinished & (high >= low.max())))


def censored_fitness(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """A fitness for individuals whose race ended early: the middle of what it can still be."""
    return (low + high) / 2.0

"""Which conditions of a study differ: all pairs, with effect sizes, correction and the runs that are still missing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from sceann_hil.study.statistics import (
    FEWEST_RUNS,
    LEVEL,
    POWER,
    Interval,
    contrast,
    contrast_p,
    fisher,
    rate_difference,
)

MOST_RUNS = 100_000
"""More runs than these are not worth asking for."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two groups of runs, compared.

    Attributes:
        one: name of the first.
        other: name of the second.
        difference: mean of the first minus mean of the second, with its 95 % interval (Welch).
        effect: the difference in standard deviations of a run (Cohen's d, both variances weighing the same).
        superiority: probability that a run of the first is better than one of the second, ties half (Vargha and
            Delaney's A).
        p: of no difference (Welch's t test), not corrected.
        p_corrected: the same after Holm's correction for all pairs that are compared.
        more_runs: further runs of each condition until a difference as large as this one would be seen with 80 %
            probability at the corrected level; 0 if it is seen already; None if it takes more than `MOST_RUNS`.
    """

    one: str
    other: str
    difference: Interval
    effect: float
    superiority: float
    p: float
    p_corrected: float
    more_runs: int | None

    @property
    def verdict(self) -> str:
        """In words."""
        if self.p_corrected >= 1.0 - LEVEL:
            return "cannot tell"
        return "higher" if self.difference.estimate > 0.0 else "lower"


Group = Sequence[NDArray[np.float64]]
"""Values of the runs of some conditions, one array of shape ``(n_runs,)`` for each."""


def all_pairs(groups: Mapping[str, Group], *, rates: bool = False) -> list[Pair]:
    """Every pair of groups.

    Args:
        groups: for each name the values of its conditions, at least 2 runs of each; a group counts as the mean of its
            conditions' means.
        rates: the values are 0 or 1. Then Newcombe's interval and Fisher's exact test are for all runs of a group
            together.

    Returns:
        In the order of the names.
    """
    names = list(combinations(groups, 2))
    tests = [(_test_of_rates if rates else _test)(groups[one], groups[other]) for one, other in names]
    corrected = holm([p for _, p in tests])
    return [
        _pair(one, other, groups[one], groups[other], difference, p, p_corrected, len(names))
        for (one, other), (difference, p), p_corrected in zip(names, tests, corrected, strict=True)
    ]


def holm(p_values: Sequence[float]) -> list[float]:
    """Holm's step-down correction (1979): the chance of one false difference among all stays below the level."""
    order = np.argsort(p_values)
    corrected, largest = [0.0] * len(p_values), 0.0
    for rank, place in enumerate(order.tolist()):
        largest = max(largest, min(1.0, (len(p_values) - rank) * p_values[place]))
        corrected[place] = largest
    return corrected


def runs_to_see(effect: float, n_comparisons: int) -> float:
    """Runs of each of two conditions until a difference of so many standard deviations is seen with 80 % probability.

    Two-sided test at 5 % divided by the number of comparisons, normal approximation.
    """
    if effect == 0.0:
        return math.inf
    z = float(stats.norm.ppf(1.0 - (1.0 - LEVEL) / 2.0 / max(1, n_comparisons)) + stats.norm.ppf(POWER))
    return max(float(FEWEST_RUNS), math.ceil(2.0 * (z / effect) ** 2))


def _test(one: Group, other: Group) -> tuple[Interval, float]:
    samples = dict(enumerate([*one, *other]))
    weights = {k: 1.0 / len(one) if k < len(one) else -1.0 / len(other) for k in samples}
    return contrast(samples, weights), 1.0 if _are_few(one, other) else contrast_p(samples, weights)


def _test_of_rates(one: Group, other: Group) -> tuple[Interval, float]:
    mine, theirs = ((sum(int(values.sum()) for values in group), sum(map(len, group))) for group in (one, other))
    return rate_difference(mine, theirs), 1.0 if _are_few(one, other) else fisher(mine, theirs)


def _are_few(one: Group, other: Group) -> bool:
    return min(len(values) for values in (*one, *other)) < FEWEST_RUNS


def _pair(
    one: str,
    other: str,
    mine: Group,
    theirs: Group,
    difference: Interval,
    p: float,
    p_corrected: float,
    n_comparisons: int,
) -> Pair:
    variances = [np.mean([values.var(ddof=1) for values in group]) for group in (mine, theirs)]
    deviation = float(np.sqrt(np.mean(variances)))
    effect = difference.estimate / deviation if deviation > 0.0 else math.copysign(math.inf, difference.estimate)
    if difference.estimate == 0.0:
        effect = 0.0
    have = min(len(values) for values in (*mine, *theirs))
    # a group's mean over several conditions scatters less than one condition's
    needed = runs_to_see(effect * math.sqrt(min(len(mine), len(theirs))), n_comparisons)
    more = max(1, int(needed) - have) if needed <= MOST_RUNS else None
    seen = p_corrected < 1.0 - LEVEL
    return Pair(one, other, difference, effect, _superiority(mine, theirs), p, p_corrected, 0 if seen else more)


def _superiority(one: Group, other: Group) -> float:
    mine, theirs = np.concatenate(one), np.concatenate(other)
    statistic = float(stats.mannwhitneyu(mine, theirs).statistic)
    return statistic / (len(mine) * len(theirs))

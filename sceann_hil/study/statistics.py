"""Intervals and tests; all of them at 95 % unless said otherwise. SciPy does the mathematics.

Success rates: Wilson's interval (1927) and Newcombe's hybrid interval for differences (1998, method 10). Means: linear
contrasts with Welch's standard error and Satterthwaite's degrees of freedom.

SciPy is imported where it is used: looking at a run, and a transfer's conclusion, need none of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

LEVEL = 0.95
POWER = 0.8
"""Probability with which a difference that matters should be seen."""
FEWEST_RUNS = 10
"""From fewer runs of a condition nothing is concluded: Student's intervals presume that a mean is about normal."""
_K = TypeVar("_K")


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate and its confidence interval."""

    estimate: float
    low: float
    high: float

    @property
    def contains_zero(self) -> bool:
        """Zero is not excluded."""
        return self.low <= 0.0 <= self.high


def wilson(successes: int, n: int, level: float = LEVEL) -> Interval:
    """A success rate and Wilson's score interval."""
    from scipy import stats

    found = stats.binomtest(successes, n).proportion_ci(level, method="wilson")
    return Interval(successes / n, float(found.low), float(found.high))


def rate_difference(one: tuple[int, int], other: tuple[int, int], level: float = LEVEL) -> Interval:
    """Rate of `one` minus rate of `other`, each as (successes, n): Newcombe's hybrid score interval."""
    a, b = wilson(*one, level), wilson(*other, level)
    difference = a.estimate - b.estimate
    low = difference - float(np.hypot(a.estimate - a.low, b.high - b.estimate))
    high = difference + float(np.hypot(a.high - a.estimate, b.estimate - b.low))
    return Interval(difference, low, high)


def fisher(one: tuple[int, int], other: tuple[int, int]) -> float:
    """Two-sided p value of Fisher's exact test that two rates, each as (successes, n), are equal."""
    from scipy import stats

    table = np.array([[one[0], one[1] - one[0]], [other[0], other[1] - other[0]]])
    return float(stats.fisher_exact(table).pvalue)


def mean_interval(values: NDArray[np.float64], level: float = LEVEL) -> Interval:
    """A mean and Student's interval."""
    return contrast({0: values}, {0: 1.0}, level)


def student_quantile(probability: float, freedom: int) -> float:
    """Quantile of Student's t for whole degrees of freedom, without SciPy: a robot's host has none.

    Abramowitz and Stegun (1964), Eq. 26.7.3 and 26.7.4, turned round by bisection.

    Args:
        probability: 0.5 to below 1.
        freedom: degrees of freedom, 1 or more.
    """
    if not (0.5 <= probability < 1.0 and freedom >= 1):
        raise ValueError(f"expected a probability in [0.5, 1) and freedom >= 1, got {probability} and {freedom}")
    low, high = 0.0, np.pi / 2.0
    for _ in range(100):
        angle = 0.5 * (low + high)
        low, high = (angle, high) if _within(angle, freedom) < 2.0 * probability - 1.0 else (low, angle)
    return float(np.sqrt(freedom) * np.tan(0.5 * (low + high)))


def _within(angle: float, freedom: int) -> float:
    """Probability that |t| is below sqrt(freedom) tan(angle)."""
    sine, cosine = np.sin(angle), np.cos(angle)
    odd = freedom % 2
    term = cosine if odd else 1.0
    total = 0.0
    for k in range(odd, freedom - 1, 2):
        total += term
        term *= cosine**2 * (k + 1) / (k + 2)
    return float(2.0 / np.pi * (angle + sine * total) if odd else sine * total)


def contrast(samples: Mapping[_K, NDArray[np.float64]], weights: Mapping[_K, float], level: float = LEVEL) -> Interval:
    """A weighted sum of the means of independent samples, such as one mean minus another.

    Args:
        samples: at least the samples that `weights` names, each with two values or more.
        weights: factor of each sample's mean.
        level: of the two-sided interval.
    """
    from scipy import stats

    estimate, error, freedom = _welch(samples, weights)
    if error == 0.0:
        return Interval(estimate, estimate, estimate)
    reach = error * float(stats.t.ppf(0.5 + level / 2.0, freedom))
    return Interval(estimate, estimate - reach, estimate + reach)


def contrast_p(samples: Mapping[_K, NDArray[np.float64]], weights: Mapping[_K, float]) -> float:
    """Two-sided p value that a contrast is 0; arguments as in `contrast`."""
    from scipy import stats

    estimate, error, freedom = _welch(samples, weights)
    if error == 0.0:
        return 1.0 if estimate == 0.0 else 0.0
    return float(2.0 * stats.t.sf(abs(estimate) / error, freedom))


def _welch(samples: Mapping[_K, NDArray[np.float64]], weights: Mapping[_K, float]) -> tuple[float, float, float]:
    """A contrast's estimate, its standard error and Satterthwaite's degrees of freedom."""
    estimate = sum(weight * float(samples[key].mean()) for key, weight in weights.items())
    parts = np.array([weight**2 * samples[key].var(ddof=1) / len(samples[key]) for key, weight in weights.items()])
    freedom = np.array([len(samples[key]) - 1 for key in weights])
    total = float(parts.sum())
    if total == 0.0:
        return estimate, 0.0, float(freedom.sum())
    return estimate, float(np.sqrt(total)), float(total**2 / (parts**2 / freedom).sum())


def sees_rate_difference(rate: float, n_one: int, n_other: int, difference: float) -> bool:
    """Whether two samples of these sizes would have told a difference in success rate, with 80 % probability.

    Normal approximation at 5 %, for the harder of the two sides on which the other rate can lie.

    Args:
        rate: of one of them.
        n_one: its runs.
        n_other: runs of the other.
        difference: that is to be seen, as a part of 1.
    """
    from scipy import stats

    z = float(stats.norm.ppf(0.5 + LEVEL / 2.0) + stats.norm.ppf(POWER))
    others = [other for other in (rate - difference, rate + difference) if 0.0 <= other <= 1.0]
    errors = [np.sqrt(rate * (1.0 - rate) / n_one + other * (1.0 - other) / n_other) for other in others]
    return bool(others) and all(z * error <= difference for error in errors)


class Verdict(StrEnum):
    """What the data say of a claim."""

    HOLDS = "holds"
    DOES_NOT_HOLD = "does not hold"
    CANNOT_TELL = "cannot tell"


@dataclass(frozen=True, slots=True)
class Statement:
    """One comparison of a claim: something that should be positive.

    Attributes:
        name: what is compared, for people.
        interval: of the difference, at 95 %.
        strict: the same at the level that keeps the chance of one false contradiction in the whole claim below 5 %.
    """

    name: str
    interval: Interval
    strict: Interval

    @property
    def verdict(self) -> Verdict:
        """Positive, negative, or neither."""
        if self.interval.low > 0.0:
            return Verdict.HOLDS
        return Verdict.DOES_NOT_HOLD if self.strict.high < 0.0 else Verdict.CANNOT_TELL


def judge(statements: Sequence[Statement]) -> Verdict:
    """A claim that consists of several statements.

    It holds if each of them is significantly positive (an intersection-union test, so the level needs no correction),
    does not hold if at least one is significantly negative (with Bonferroni's correction), and else is open.
    """
    verdicts = {statement.verdict for statement in statements}
    if Verdict.DOES_NOT_HOLD in verdicts:
        return Verdict.DOES_NOT_HOLD
    return Verdict.CANNOT_TELL if Verdict.CANNOT_TELL in verdicts else Verdict.HOLDS


def strict_level(n_statements: int) -> float:
    """Bonferroni's two-sided level for `n_statements` one-sided contradictions at 5 % in all."""
    return 1.0 - 2.0 * (1.0 - LEVEL) / max(n_statements, 1) if n_statements > 1 else LEVEL

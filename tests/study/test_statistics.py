"""Intervals agree with published examples and with SciPy; verdicts follow from them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from sceann_hil.study.statistics import (
    Interval,
    Statement,
    Verdict,
    contrast,
    fisher,
    judge,
    mean_interval,
    rate_difference,
    strict_level,
    wilson,
)


def test_wilson_s_interval_is_the_published_one() -> None:
    # Newcombe 1998 (one sample), table I, method 3
    for successes, n, low, high in [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611)]:
        interval = wilson(successes, n)
        assert interval.estimate == successes / n
        assert (interval.low, interval.high) == (pytest.approx(low, abs=6e-5), pytest.approx(high, abs=6e-5))


def test_the_interval_of_a_difference_is_the_published_one() -> None:
    # Newcombe 1998 (two samples), table II, method 10
    interval = rate_difference((56, 70), (48, 80))
    assert (interval.low, interval.high) == (pytest.approx(0.0524, abs=6e-5), pytest.approx(0.3339, abs=6e-5))
    interval = rate_difference((9, 10), (3, 10))
    assert (interval.low, interval.high) == (pytest.approx(0.1705, abs=6e-5), pytest.approx(0.8090, abs=6e-5))


def test_a_difference_of_two_means_is_welch_s() -> None:
    rng = np.random.default_rng(1)
    samples = {"a": rng.normal(3.0, 1.0, 20), "b": rng.normal(2.0, 4.0, 50)}
    ours = contrast(samples, {"a": 1.0, "b": -1.0})
    theirs = stats.ttest_ind(samples["a"], samples["b"], equal_var=False).confidence_interval(0.95)
    assert (ours.low, ours.high) == (pytest.approx(theirs.low), pytest.approx(theirs.high))


def test_a_mean_is_student_s() -> None:
    values = np.random.default_rng(2).normal(size=30)
    ours = mean_interval(values, 0.9)
    theirs = stats.ttest_1samp(values, 0.0).confidence_interval(0.9)
    assert (ours.low, ours.high) == (pytest.approx(theirs.low), pytest.approx(theirs.high))


def test_values_without_spread_have_an_interval_without_width() -> None:
    assert mean_interval(np.zeros(50)) == Interval(0.0, 0.0, 0.0)


def test_intervals_contain_the_truth_as_often_as_they_say() -> None:
    rng = np.random.default_rng(3)
    hits = 0
    for _ in range(1000):
        samples = {k: rng.normal(k, 1.0 + k, 12 + 5 * k) for k in range(3)}
        interval = contrast(samples, {0: 1.0, 1: -2.0, 2: 1.0})
        hits += interval.low <= 0.0 <= interval.high
    assert 930 <= hits <= 970


def test_fisher_s_test_is_two_sided() -> None:
    assert fisher((13, 50), (104, 1000)) == pytest.approx(fisher((104, 1000), (13, 50)))
    assert fisher((5, 10), (50, 100)) == pytest.approx(1.0)


def statement(low: float, high: float, strict_high: float | None = None) -> Statement:
    middle = (low + high) / 2.0
    return Statement(
        "s", Interval(middle, low, high), Interval(middle, low, high if strict_high is None else strict_high)
    )


@pytest.mark.parametrize(
    ("statements", "verdict"),
    [
        ([statement(0.1, 0.2), statement(0.01, 5.0)], Verdict.HOLDS),
        ([statement(0.1, 0.2), statement(-0.1, 5.0)], Verdict.CANNOT_TELL),
        ([statement(0.1, 0.2), statement(-0.2, -0.1)], Verdict.DOES_NOT_HOLD),
        ([statement(-0.1, 0.1), statement(-0.2, -0.1)], Verdict.DOES_NOT_HOLD),
        # negative at 95 %, but not after the correction for many comparisons
        ([statement(0.1, 0.2), statement(-0.2, -0.1, 0.05)], Verdict.CANNOT_TELL),
    ],
)
def test_a_claim_holds_only_if_all_of_it_does(statements: list[Statement], verdict: Verdict) -> None:
    assert judge(statements) is verdict


def test_many_comparisons_contradict_a_true_claim_in_less_than_5_percent_of_studies() -> None:
    rng = np.random.default_rng(4)
    level, wrong = strict_level(20), 0
    for _ in range(400):
        samples = {k: rng.normal(0.0, 1.0, 30) for k in range(40)}
        pairs = [{2 * k: 1.0, 2 * k + 1: -1.0} for k in range(20)]
        found = [Statement("", contrast(samples, w), contrast(samples, w, level)) for w in pairs]
        wrong += judge(found) is Verdict.DOES_NOT_HOLD
    assert wrong / 400 < 0.08

"""Pairs of conditions: corrected tests, effect sizes and the runs that are missing."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from sceann_hil.study.pairwise import all_pairs, holm, runs_to_see


def test_holm_s_correction_is_the_published_one() -> None:
    # Holm 1979: sorted p times n, n-1, ..., never falling
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.5, 0.9]) == pytest.approx([1.0, 1.0])
    assert holm([]) == []


def test_equal_conditions_seldom_differ() -> None:
    rng = np.random.default_rng(1)
    false_alarms = 0
    for _ in range(300):
        groups = {name: [rng.normal(0.0, 1.0, 15)] for name in "abcd"}
        false_alarms += any(pair.verdict != "cannot tell" for pair in all_pairs(groups))
    assert false_alarms <= 24


def test_a_difference_is_found_with_its_size() -> None:
    rng = np.random.default_rng(2)
    groups = {"a": [rng.normal(2.0, 1.0, 400)], "b": [rng.normal(1.0, 1.0, 400)]}
    (pair,) = all_pairs(groups)
    assert (pair.one, pair.other, pair.verdict, pair.more_runs) == ("a", "b", "higher", 0)
    assert pair.effect == pytest.approx(1.0, abs=0.15)
    assert pair.superiority == pytest.approx(stats.norm.cdf(1.0 / math.sqrt(2.0)), abs=0.04)
    assert pair.difference.low < 1.0 < pair.difference.high


def test_as_many_runs_as_asked_for_show_the_difference() -> None:
    """Cohen 1988: d = 0.5 at 5 % and 80 % power needs 63 to 64 runs of each."""
    assert runs_to_see(0.5, 1) == 63
    assert runs_to_see(0.0, 1) == math.inf
    rng = np.random.default_rng(3)
    n = int(runs_to_see(0.6, 3))
    seen = 0
    for _ in range(300):
        groups = {"a": [rng.normal(0.6, 1.0, n)], "b": [rng.normal(0.0, 1.0, n)], "c": [rng.normal(9.0, 1.0, n)]}
        seen += all_pairs(groups)[0].verdict == "higher"
    # Holm's correction is milder than the one that was planned with
    assert seen / 300 > 0.76


def test_few_runs_tell_nothing_however_equal_they_are_among_themselves() -> None:
    groups = {"a": [np.ones(3)], "b": [np.zeros(3)]}
    for rates in (False, True):
        (pair,) = all_pairs(groups, rates=rates)
        assert pair.verdict == "cannot tell"
        assert pair.more_runs == 7


def test_rates_are_compared_by_newcombe_and_fisher() -> None:
    groups = {"a": [np.repeat([1.0, 0.0], [15, 5])], "b": [np.repeat([1.0, 0.0], [5, 15])]}
    (pair,) = all_pairs(groups, rates=True)
    assert pair.p == pytest.approx(stats.fisher_exact([[15, 5], [5, 15]]).pvalue)
    assert pair.verdict == "higher"
    (none,) = all_pairs({"a": [np.zeros(20)], "b": [np.zeros(20)]}, rates=True)
    assert none.difference.low < 0.0 < none.difference.high


def test_a_group_of_conditions_counts_as_the_mean_of_their_means() -> None:
    one = [np.linspace(0.0, 1.0, 20), np.linspace(4.0, 5.0, 20)]
    other = [np.linspace(0.0, 1.0, 20), np.linspace(2.0, 3.0, 20)]
    (pair,) = all_pairs({"a": one, "b": other})
    assert pair.difference.estimate == pytest.approx(1.0)
    assert pair.verdict == "higher"

"""Claims become the comparisons that they say, and the verdict follows the data."""

from __future__ import annotations

import numpy as np
import pytest

from sceann_hil.network.coding import Coding
from sceann_hil.study.report import paper
from sceann_hil.study.report.cells import Key
from sceann_hil.study.report.claims import (
    compare,
    mean_of,
    minus,
    oga_above_sga,
    oga_above_sga_on_average,
    rising,
    slope,
)
from sceann_hil.study.statistics import Verdict

C = Coding.SCEANN3


def samples(mean: object, n: int = 40) -> dict[Key, np.ndarray]:
    """`n` values around ``mean(key)`` for a small grid."""
    rng = np.random.default_rng(1)
    return {
        key: rng.normal(mean(key), 0.1, n)  # type: ignore[operator]
        for key in (Key(C, a, s, h) for a in ("sga", "oga") for s in (1, 2) for h in (1, 2, 3))
    }


def point(value: float) -> str:
    return f"{value:.2f}"


def test_what_rises_holds_what_falls_does_not_and_what_is_flat_stays_open() -> None:
    for way, verdict in ((1.0, Verdict.HOLDS), (-1.0, Verdict.DOES_NOT_HOLD), (0.0, Verdict.CANNOT_TELL)):
        data = samples(lambda key, way=way: way * key.n_hidden)
        claim = compare("1", "it rises", data, rising(C, "sga", (1, 2), (1, 2, 3)), point)
        assert claim.verdict is verdict


def test_the_evidence_counts_and_names_what_contradicts() -> None:
    data = samples(lambda key: -1.0 if key == Key(C, "oga", 1, 3) else key.algorithm == "oga")
    claim = compare("1", "the OGA is better", data, oga_above_sga([C], (1, 2), (1, 2, 3)), point)
    assert claim.verdict is Verdict.DOES_NOT_HOLD
    assert "5 of 6 comparisons point this way, 5 of them significantly; 1 contradict" in claim.evidence
    assert "Against it: SCEANN3 (1,3) -" in claim.evidence


def test_a_slope_is_that_of_the_straight_line() -> None:
    data = samples(lambda key: 2.0 + 0.3 * key.n_hidden)
    _, weights = slope(C, "sga", (1, 2), (1, 2, 3), 1.0)
    mean = sum(weight * data[key].mean() for key, weight in weights.items())
    by_hand = np.mean(
        [np.polyfit([1, 2, 3], [data[Key(C, "sga", s, h)].mean() for h in (1, 2, 3)], 1)[0] for s in (1, 2)]
    )
    assert mean == pytest.approx(by_hand)


def test_contrasts_add_up_to_zero() -> None:
    listed = [
        *rising(C, "sga", (1, 2), (1, 2, 3)),
        *oga_above_sga([C], (1, 2), (1, 2, 3)),
        *oga_above_sga_on_average([C, Coding.SCEANN2], (1, 2), (1, 2, 3)),
        slope(C, "oga", (1, 2), (1, 2, 3), -1.0),
        ("", minus(mean_of([Key(C, "sga", 1, 1), Key(C, "sga", 1, 2)]), mean_of([Key(C, "sga", 2, 1)]))),
    ]
    for _, weights in listed:
        assert sum(weights.values()) == pytest.approx(0.0, abs=1e-12)


def test_the_paper_s_tables_are_whole_numbers_of_50_runs() -> None:
    assert len(paper.SUCCESS_PERCENT) == 20
    assert all(percent * paper.RUNS % 100 == 0 for percent in paper.SUCCESS_PERCENT.values())
    assert paper.successes(Key(Coding.SCEANN3, "oga", 2, 3)) == 22
    assert sum(map(paper.successes, paper.SUCCESS_PERCENT)) == 121

"""Sentences and tables that several sections share."""

from __future__ import annotations

from collections.abc import Sequence

from sceann_hil.study.report.cells import StudyData
from sceann_hil.study.report.claims import Claim
from sceann_hil.study.report.page import Page
from sceann_hil.study.statistics import Interval, Verdict
from sceann_hil.timespans import duration_text

_MARKS = {Verdict.HOLDS: "✓ holds", Verdict.DOES_NOT_HOLD: "✗ does not hold", Verdict.CANNOT_TELL: "? cannot tell"}


def percent(rate: Interval) -> str:
    """A rate with its interval, such as ``34 [22, 48]``."""
    return f"{100 * rate.estimate:.3g} [{100 * rate.low:.3g}, {100 * rate.high:.3g}]"


def verdict_text(verdict: Verdict) -> str:
    """A verdict as it stands in tables."""
    return f"**{_MARKS[verdict]}**"


def runs_sentence(study: StudyData) -> str:
    """How much was run, and how long it took."""
    missing = f" {study.missing} conditions have no runs yet." if study.missing else ""
    return (
        f"Study `{study.name}`: {len(study.cells)} conditions, {study.n_runs} runs each, seed {study.seed}; "
        f"{duration_text(study.effort.wall_s)} on {', then '.join(study.effort.workers)}.{missing}"
    )


def claims_table(page: Page, claims: Sequence[Claim]) -> None:
    """Claims with verdict and evidence."""
    rows = [[claim.number, claim.text, verdict_text(claim.verdict), claim.evidence] for claim in claims]
    page.table(["", "claim", "verdict", "evidence (differences with 95 % intervals)"], rows)

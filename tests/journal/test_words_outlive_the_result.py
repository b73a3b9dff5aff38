"""What an operator says of a trial before its result is journalled stays with the trial."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from sceann_hil.journal import JOURNAL_NAME
from tests.supervision.operators.fakes import attended_run


@pytest.mark.parametrize(
    ("answers", "expected"),
    [
        (["after: note it wobbled", "accept"], "it wobbled"),
        (["after: note it wobbled", "discard it fell"], "it wobbled; discard: it fell"),
    ],
)
def test_a_note_before_the_verdict_is_kept(answers: list[str], expected: str, tmp_path: Path) -> None:
    """Regression: the result, written after it, took its place."""
    attended_run(tmp_path / "run", ["ready", *answers, "finish"])
    database = sqlite3.connect(tmp_path / "run" / JOURNAL_NAME)
    assert database.execute("SELECT note FROM attempt WHERE id = 1").fetchone() == (expected,)
    database.close()

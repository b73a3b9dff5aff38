"""The questions in docs/journal.md are asked, so that none of them goes stale."""

from __future__ import annotations

import re
import sqlite3
from pathlib import Path

import pytest

from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.journal.schema import SCHEMA
from tests.runs import GOAL, evolve

DOCUMENT = (Path(__file__).parents[2] / "docs" / "journal.md").read_text(encoding="utf-8")
QUESTIONS = re.findall(r"```sql\n(.*?)```", DOCUMENT, re.DOTALL)[0].strip().split("\n\n")


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda q: q.splitlines()[0])
def test_every_documented_question_has_an_answer(question: str, tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL)
    assert sqlite3.connect(tmp_path / "run" / JOURNAL_NAME).execute(question).fetchall()


def test_every_table_is_documented() -> None:
    tables = re.findall(r"CREATE TABLE (\w+)", SCHEMA)
    assert re.findall(r"^\| `(\w+)` \|", DOCUMENT, re.MULTILINE) == tables

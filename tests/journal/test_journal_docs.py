"""The questions in docs/journal.md are asked, so that none of them goes stale."""

from __future__ import annotations

import re
import sqlite3
from pathlib import Path

import pytest

from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.journal.schema import SCHEMA
from sceann_hil.run.ancestor import Ancestor, Take
from sceann_hil.run.experiment import Experiment
from tests.runs import GOAL, config_of, evolve

DOCUMENT = (Path(__file__).parents[2] / "docs" / "journal.md").read_text(encoding="utf-8")
QUESTIONS, ACROSS = (text.strip().split("\n\n") for text in re.findall(r"```sql\n(.*?)```", DOCUMENT, re.DOTALL))


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda q: q.splitlines()[0])
def test_every_documented_question_has_an_answer(question: str, tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL)
    assert sqlite3.connect(tmp_path / "run" / JOURNAL_NAME).execute(question).fetchall()


def test_every_table_is_documented() -> None:
    tables = re.findall(r"CREATE TABLE (\w+)", SCHEMA)
    assert re.findall(r"^\| `(\w+)` \|", DOCUMENT, re.MULTILINE) == tables


@pytest.mark.parametrize("take", list(Take))
def test_a_line_of_descent_ends_also_across_runs(take: Take, tmp_path: Path) -> None:
    """Regression: ids of the other run met those of this one, and the documented question had no end."""
    evolve(tmp_path / "first", GOAL)
    config = config_of(GOAL)
    with (
        Experiment.create(config, tmp_path / "on", Ancestor(tmp_path / "first", take)) as experiment,
        config.robot.build() as robot,
    ):
        experiment.evolve(robot)
    db = sqlite3.connect(tmp_path / "on" / JOURNAL_NAME)
    (line,) = (question for question in QUESTIONS if "line of descent" in question)
    assert [row[1] for row in db.execute(line)] == [3, 2, 1, 0]
    attach, across = ACROSS
    db.execute(attach.replace("runs/first", str(tmp_path / "first")))
    rows = db.execute(across).fetchall()
    assert [(row[0], row[2]) for row in rows] == [
        *(("this run", number) for number in (3, 2, 1, 0)),
        *(("the run before", number) for number in (3, 2, 1, 0)),
    ]
    parent = db.execute("SELECT genome FROM before.individual WHERE id = ?", (rows[3][5],)).fetchone()
    assert parent == (rows[4][3],)

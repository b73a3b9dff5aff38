"""A journal written by schema 1 opens for reading as it is, and is brought up to date when it is opened for writing."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import pytest

from sceann_hil.errors import RunIsDamaged
from sceann_hil.journal import JOURNAL_NAME, AttemptKind, JournalReader
from sceann_hil.journal.schema import SCHEMA, SCHEMA_VERSION, statements
from sceann_hil.robot import EndReason
from sceann_hil.run.experiment import Outcome
from tests.runs import resume

GOLDEN = Path(__file__).parent / "data" / "schema1.sqlite"


@pytest.fixture
def old(tmp_path: Path) -> Path:
    shutil.copy(GOLDEN, tmp_path / JOURNAL_NAME)
    return tmp_path


def _answers(directory: Path) -> list[object]:
    """Everything that a reader tells of the golden journal."""
    reader = JournalReader(directory)
    try:
        generations = reader.generations()
        return [
            reader.run(),
            generations,
            [reader.algorithm_state(g.number) for g in generations],
            [reader.individuals(g.number) for g in generations],
            [reader.attempts(g.number) for g in generations],
            reader.attempts_of_kind(AttemptKind.REFERENCE),
            reader.sessions(),
            reader.events(),
            reader.spent(),
            reader.costs(),
            reader.limits(),
            [
                None if m is None else [part.tolist() for part in m]
                for m in (reader.sensor_trace(1), reader.sensor_trace(2))
            ],
        ]
    finally:
        reader.close()


def test_it_is_read_as_it_is(old: Path) -> None:
    before = (old / JOURNAL_NAME).read_bytes()
    reader = JournalReader(old)
    first, *_ = reader.attempts(0)
    assert (first.kind, first.generation, first.genome, first.value) == (AttemptKind.EVOLUTION, 0, None, None)
    assert first.start == (0.0275, 0.0275, 0.0)
    assert first.noise_key == 0xDF7383BE87F2138D
    assert (first.end_reason, first.steps, first.state_hash) == (EndReason.TIME_UP, 60, 54900)
    assert first.final_state == (0.10241536051034927, 0.057917214930057526, 1.807494044303894)
    void, unknown = reader.attempts(1)
    assert (void.end_reason, void.note, void.operator_s) == (EndReason.OPERATOR, "wheel slipped; looked away", 12.5)
    assert (unknown.end_reason, unknown.attempt) == (None, 1)
    references = reader.attempts_of_kind(AttemptKind.REFERENCE)
    assert [(row.id, row.genome, row.end_reason, row.fitness) for row in references] == [
        (21, "c6c42d5b60", EndReason.TIME_UP, 0.25),
        (22, "c6c42d5b60", EndReason.LINK_LOST, None),
    ]
    spent = reader.spent()
    assert (spent.robot_s, spent.trials, spent.unsettled) == (228.0, 22, 1)
    assert [(row.robot, row.body) for row in reader.sessions()] == [("diffdrive", None), ("a robot", None)]
    reader.close()
    assert (old / JOURNAL_NAME).read_bytes() == before


def test_going_on_brings_it_up_to_date_and_changes_nothing_that_was_known(old: Path) -> None:
    before = _answers(old)
    assert resume(old) is Outcome.FINISHED
    db = sqlite3.connect(old / JOURNAL_NAME)
    assert db.execute("PRAGMA user_version").fetchone() == (SCHEMA_VERSION,)
    tables = {row[0] for row in db.execute("SELECT name FROM sqlite_schema WHERE sql IS NOT NULL")}
    fresh = sqlite3.connect(":memory:")
    for statement in statements(SCHEMA):
        fresh.execute(statement)
    assert tables == {row[0] for row in fresh.execute("SELECT name FROM sqlite_schema WHERE sql IS NOT NULL")}
    assert db.execute("PRAGMA foreign_key_check").fetchall() == []
    after = _answers(old)
    assert after[0] == before[0]
    assert after[1][0] == before[1][0]  # type: ignore[index]
    assert after[4][0] == before[4][0]  # type: ignore[index]
    assert after[5] == before[5]
    assert after[6][:2] == before[6]  # type: ignore[index]
    assert after[11] == before[11]


def test_an_old_journal_whose_updating_is_cut_off_is_still_the_old_one(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = _answers(old)
    monkeypatch.setattr("sceann_hil.journal.schema1.SCHEMA", SCHEMA + "CREATE TABLE event (nonsense);\n")
    with pytest.raises(RunIsDamaged, match="event already exists"):
        resume(old)
    assert _answers(old) == before

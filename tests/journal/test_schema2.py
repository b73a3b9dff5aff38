"""A journal written by schema 2 opens for reading as it is, and is brought up to date when it is opened for writing."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from sceann_hil.journal import JOURNAL_NAME, JournalReader
from sceann_hil.journal.schema import SCHEMA_VERSION
from sceann_hil.journal.seal import seal_path
from sceann_hil.journal.verify import examine
from sceann_hil.run.experiment import Experiment, Outcome
from tests.runs import POLE, contents, evolve, resume


@pytest.fixture
def old(tmp_path: Path) -> Path:
    """All that schema 2 lacks are the tables for the robot and for batches."""
    evolve(tmp_path / "run", POLE, "algorithm.generations=2")
    path = tmp_path / "run" / JOURNAL_NAME
    db = sqlite3.connect(path)
    db.execute("DROP TABLE batch")
    db.execute("DROP TABLE robot")
    db.execute("PRAGMA user_version = 2")
    db.commit()
    db.close()
    seal_path(path).unlink()
    return tmp_path / "run"


def test_it_is_read_and_checked_as_it_is(old: Path) -> None:
    before = (old / JOURNAL_NAME).read_bytes()
    reader = JournalReader(old)
    assert reader.schema_version == 2
    assert reader.count_attempts() == sum(len(reader.attempts(g.number)) for g in reader.generations())
    reader.close()
    verdict = examine(old)
    assert (verdict.damage, verdict.last_sound, verdict.has_checksums) == ((), 2, True)
    assert (old / JOURNAL_NAME).read_bytes() == before


def test_its_damage_is_noticed(old: Path) -> None:
    db = sqlite3.connect(old / JOURNAL_NAME)
    db.execute("UPDATE attempt SET steps = steps + 1 WHERE id = 3")
    db.commit()
    db.close()
    assert any("trial 3 of generation 0" in words for words in examine(old).damage)


def test_going_on_brings_it_up_to_date(old: Path) -> None:
    before = contents(old)
    assert resume(old) is Outcome.FINISHED
    assert contents(old) == before
    db = sqlite3.connect(old / JOURNAL_NAME)
    assert db.execute("PRAGMA user_version").fetchone() == (SCHEMA_VERSION,)
    assert db.execute("SELECT count(*) FROM batch").fetchone() == (0,)
    Experiment.open(old).close()

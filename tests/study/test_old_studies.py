"""A study written by schema 1 is read as it is, and brought up to date when it goes on."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.errors import OtherVersions, RunIsDamaged
from sceann_hil.study import STUDY_NAME, StudyReader, StudyStore
from sceann_hil.study.config import parse_study
from sceann_hil.study.store import examine_study
from tests.study.small_study import SMALL

GOLDEN = Path(__file__).parent / "data" / "schema1.sqlite"


@pytest.fixture
def old(tmp_path: Path) -> Path:
    shutil.copy(GOLDEN, tmp_path / STUDY_NAME)
    return tmp_path


def test_it_is_read_and_goes_on_with_the_same_numbers(old: Path) -> None:
    with StudyReader(old) as reader:
        before = [reader.runs(condition.number) for condition in reader.conditions()]
        assert [len(runs) for runs in before] == [12] * 4
        assert reader.effort().workers == ("one process",)
    study = parse_study(SMALL, "s")
    with StudyStore.begin_or_continue(study, old, "the test", accept_other_versions=True) as store:
        for runs, condition in zip(before, store.conditions(), strict=True):
            now = store.runs(condition.number)
            assert now.genomes == runs.genomes
            np.testing.assert_array_equal(now.best, runs.best)
            np.testing.assert_array_equal(now.seeds, runs.seeds)
    assert not examine_study(old).damage
    assert sqlite3.connect(old / STUDY_NAME).execute("PRAGMA user_version").fetchone() == (2,)


def test_other_versions_are_refused_unless_they_are_asked_for(old: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    study = parse_study(SMALL, "s")
    StudyStore.begin_or_continue(study, old, "one", accept_other_versions=True).close()
    monkeypatch.setattr("sceann_hil.study.store.circumstances", lambda _: {"sceann-hil": "99", "numpy": "1"})
    with pytest.raises(OtherVersions, match=r"sceann-hil: .* before, 99 now"):
        StudyStore.begin_or_continue(study, old, "another")
    with StudyStore.begin_or_continue(study, old, "another", accept_other_versions=True) as store:
        assert [session.versions.get("sceann-hil") for session in store.sessions()][-1] == "99"


@pytest.mark.parametrize("table", ["study", "condition", "run", "session"])
def test_a_changed_row_is_noticed_and_named(old: Path, table: str) -> None:
    study = parse_study(SMALL, "s")
    StudyStore.begin_or_continue(study, old, "one", accept_other_versions=True).close()
    column = {"study": "name", "condition": "settings", "run": "genome", "session": "workers"}[table]
    with sqlite3.connect(old / STUDY_NAME) as db:
        db.execute(f"UPDATE {table} SET {column} = {column} || 'x'")
    assert examine_study(old).damage
    with pytest.raises(RunIsDamaged, match="is damaged"):
        StudyStore.begin_or_continue(study, old, "another", accept_other_versions=True)

"""Many attempts that are simulated in one call are intended in one row, and end as a row each."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.errors import RunIsDamaged
from sceann_hil.journal import JOURNAL_NAME, Journal, JournalReader, Slots
from sceann_hil.journal.intents import LARGE, pack_slots, unpack_slots
from sceann_hil.journal.verify import examine
from sceann_hil.robot import EndReason, Results
from sceann_hil.run.experiment import Experiment
from tests.runs import POLE, config_of

N = LARGE + 3


def _intended(journal: Journal, n: int = N) -> np.ndarray:
    genomes = np.zeros((n, 24), np.uint8)
    journal.begin_generation(0, b"", genomes, [None] * n, [None] * n)
    slots = Slots(np.arange(n), np.zeros(n, np.int64), np.zeros(n, np.int64))
    return journal.intend(0, slots, np.zeros((n, 4)), np.arange(2**64 - n, 2**64, dtype=np.uint64))


def _results(n: int) -> Results:
    reasons = np.full(n, EndReason.FELL, np.uint8)
    reasons[5] = EndReason.FAULT
    steps, hashes = np.arange(n, dtype=np.int32), np.arange(n, dtype=np.uint16)
    return Results(reasons, steps, hashes, np.ones((n, 4), np.float32), np.full(n, 0.02))


def _counts(directory: Path) -> tuple[int, int]:
    db = sqlite3.connect(directory / JOURNAL_NAME)
    return db.execute("SELECT (SELECT count(*) FROM attempt), (SELECT count(*) FROM batch)").fetchone()  # type: ignore[no-any-return]


def _rows(directory: Path) -> list[tuple[object, ...]]:
    reader = JournalReader(directory)
    # all but the times of day
    return [row[:11] + row[13:] for row in reader.rows("attempt", "ORDER BY id")]


@pytest.fixture
def experiment(tmp_path: Path) -> Experiment:
    return Experiment.create(config_of(POLE), tmp_path / "run")


def test_a_row_for_all_of_them_gives_way_to_one_for_each(experiment: Experiment) -> None:
    with experiment:
        journal = experiment.journal
        ids = _intended(journal)
        assert _counts(experiment.directory) == (0, 1)
        assert journal.reader.count_attempts() == N
        journal.record(ids, _results(N), np.ones(N))
        assert _counts(experiment.directory) == (N, 0)
        rows = journal.reader.attempts(0)
        assert [row.noise_key for row in rows] == list(range(2**64 - N, 2**64))
        assert [row.fitness is None for row in rows] == [place == 5 for place in range(N)]


def test_a_few_have_a_row_each_from_the_beginning(experiment: Experiment) -> None:
    with experiment:
        _intended(experiment.journal, LARGE - 1)
        assert _counts(experiment.directory) == (LARGE - 1, 0)


def test_cut_off_and_recorded_later_they_are_the_same_rows(tmp_path: Path) -> None:
    directories = [tmp_path / "whole", tmp_path / "cut"]
    for directory in directories:
        with Experiment.create(config_of(POLE, "name=same"), directory) as experiment:
            ids = _intended(experiment.journal)
            if directory.name == "whole":
                experiment.journal.record(ids, _results(N), np.ones(N))
    with Experiment.open(tmp_path / "cut") as experiment:
        experiment.journal.begin_session("robot", "nobody", {}, {})
        assert _counts(experiment.directory) == (N, 0)
        assert all(row.end_reason is None for row in experiment.journal.reader.attempts(0))
        experiment.journal.record(ids, _results(N), np.ones(N))
    assert _rows(directories[0]) == _rows(directories[1])


def test_words_for_an_attempt_make_rows_of_its_batch_first(experiment: Experiment) -> None:
    with experiment:
        ids = _intended(experiment.journal)
        experiment.journal.annotate(int(ids[3]), "the floor is wet")
        assert _counts(experiment.directory) == (N, 0)
        experiment.journal.record(ids, _results(N), np.ones(N))
        assert experiment.journal.reader.attempt(int(ids[3])).note == "the floor is wet"


@pytest.mark.parametrize("change", ["slots = substr(slots, 2)", "attempts = attempts + 1"])
def test_a_damaged_batch_is_named(experiment: Experiment, change: str) -> None:
    with experiment:
        _intended(experiment.journal)
    db = sqlite3.connect(experiment.directory / JOURNAL_NAME)
    db.execute(f"UPDATE batch SET {change}")
    db.commit()
    db.close()
    assert any("batch 1 is not as it was written" in words for words in examine(experiment.directory).damage)
    with pytest.raises(RunIsDamaged, match="batch 1"):
        Experiment.open(experiment.directory)


def test_a_batch_whose_attempts_are_there_already_is_damage(experiment: Experiment) -> None:
    with experiment:
        ids = _intended(experiment.journal)
        row = experiment.journal.reader.database.execute("SELECT * FROM batch").fetchone()
        experiment.journal.record(ids, _results(N), np.ones(N))
    db = sqlite3.connect(experiment.directory / JOURNAL_NAME)
    db.execute(f"INSERT INTO batch VALUES ({', '.join('?' * len(row))})", row)
    db.commit()
    db.close()
    assert any("has attempts already" in words for words in examine(experiment.directory).damage)


def test_slots_are_packed_without_loss() -> None:
    columns = [np.array([0, 2**31 - 1])] * 3 + [np.array([1, 2**40]), np.array([-(2**63), 2**63 - 1])]
    for column, unpacked in zip(columns, unpack_slots(pack_slots(columns), 2), strict=True):
        np.testing.assert_array_equal(column, unpacked)
    with pytest.raises(ValueError, match="3 attempts"):
        unpack_slots(pack_slots(columns), 3)


def test_the_session_is_written_without_a_look_at_its_attempts(experiment: Experiment) -> None:
    with experiment:
        journal, database = experiment.journal, experiment.journal.reader.database
        journal.begin_session("robot", "nobody", {}, {})
        looked = 0

        def count() -> int:
            nonlocal looked
            looked += 1
            return 0

        work: list[int] = []
        for n in (N, 20 * N):
            generation = len(work)
            nothing = [None] * n
            journal.begin_generation(generation, b"", np.zeros((n, 24), np.uint8), nothing, nothing)
            slots = Slots(np.arange(n), np.zeros(n, np.int64), np.zeros(n, np.int64))
            ids = journal.intend(generation, slots, np.zeros((n, 4)), np.arange(n, dtype=np.uint64))
            journal.record(ids, _results(n), np.ones(n))
            looked = 0
            database.set_progress_handler(count, 1)
            journal._add_to_session(attempts=1)
            database.set_progress_handler(None, 0)
            work.append(looked)
        assert work[1] < 2 * work[0]

"""The journal: what it refuses, what it keeps, and that a person can question it."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.errors import NotARun, RunExists, RunIsDamaged, RunIsLocked, RunIsNewer
from sceann_hil.journal import JOURNAL_NAME, Journal, JournalReader, RunLock, Slots
from sceann_hil.robot import EndReason, Results
from sceann_hil.run.experiment import Experiment
from tests.runs import GOAL, POLE, config_of, evolve


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("runs") / "goal"
    evolve(directory, GOAL)
    return directory


def test_every_individual_has_its_parent_its_operons_and_the_mean_of_its_trials(run: Path) -> None:
    reader = JournalReader(run)
    ids = {row.id for row in reader.individuals(0)}
    assert all(row.parent is None for row in reader.individuals(0))
    for generation in reader.generations()[1:]:
        trials = reader.attempts(generation.number)
        for row in reader.individuals(generation.number):
            assert row.parent in ids
            assert row.structure is not None
            assert "operons" in row.structure
            own = [t.fitness for t in trials if t.individual == row.number]
            assert len(own) == 3
            assert row.fitness == np.mean(np.array(own, np.float64))
        ids = {row.id for row in reader.individuals(generation.number)}


def test_attempt_ids_count_from_1_in_the_order_of_the_trials(run: Path) -> None:
    reader = JournalReader(run)
    rows = [row for g in reader.generations() for row in reader.attempts(g.number)]
    assert [row.id for row in rows] == list(range(1, 4 * 6 * 3 + 1))
    assert [(row.generation, row.individual, row.trial) for row in rows] == sorted(
        (row.generation, row.individual, row.trial) for row in rows
    )


def test_a_person_can_ask_the_best_trials_of_each_heading(run: Path) -> None:
    db = sqlite3.connect(run / JOURNAL_NAME)
    rows = db.execute(
        "SELECT trial, max(attempt.fitness), genome FROM attempt "
        "JOIN individual ON individual.generation = attempt.generation "
        "AND individual.number = attempt.individual GROUP BY trial"
    ).fetchall()
    assert len(rows) == 3


def test_a_generation_s_figures_are_those_of_its_individuals(run: Path) -> None:
    reader = JournalReader(run)
    for row in reader.generations(finished=True):
        fitness = reader.fitness(row.number)
        assert (row.best_fitness, row.mean_fitness, row.worst_fitness) == (
            fitness.max(),
            fitness.mean(),
            fitness.min(),
        )
        assert row.robot_s == pytest.approx(sum(t.robot_s or 0.0 for t in reader.attempts(row.number)))


def test_the_champion_is_the_best_of_the_last_finished_generation(run: Path) -> None:
    reader = JournalReader(run)
    champion = reader.champion()
    assert champion is not None
    assert champion.generation == 3
    assert champion.fitness == reader.fitness(3).max()


def test_a_folder_without_a_journal_is_not_a_run(tmp_path: Path) -> None:
    with pytest.raises(NotARun, match="has no journal"):
        JournalReader(tmp_path)
    with pytest.raises(NotARun, match="does not exist"):
        JournalReader(tmp_path / "nowhere")


def test_somebody_else_s_database_is_not_a_run(tmp_path: Path) -> None:
    db = sqlite3.connect(tmp_path / JOURNAL_NAME)
    db.execute("CREATE TABLE t (x)")
    db.close()
    with pytest.raises(NotARun, match="not a journal of this program"):
        JournalReader(tmp_path)


def test_a_file_that_is_no_database_is_damaged(tmp_path: Path) -> None:
    (tmp_path / JOURNAL_NAME).write_bytes(b"\x00\xff" * 5_000)
    with pytest.raises(RunIsDamaged):
        JournalReader(tmp_path)


def test_a_newer_schema_is_told_apart(tmp_path: Path) -> None:
    evolve(tmp_path / "run", POLE, "algorithm.generations=0")
    db = sqlite3.connect(tmp_path / "run" / JOURNAL_NAME)
    db.execute("PRAGMA user_version = 99")
    db.close()
    with pytest.raises(RunIsNewer, match="its schema is 99"):
        JournalReader(tmp_path / "run")


def test_a_second_writer_is_refused_while_the_first_lives_and_readers_are_not(tmp_path: Path) -> None:
    with Experiment.create(config_of(POLE), tmp_path / "run") as first:
        with pytest.raises(RunIsLocked, match="is in use: process"):
            Experiment.open(tmp_path / "run")
        assert RunLock.is_held(tmp_path / "run")
        assert JournalReader(tmp_path / "run").run().root_seed == first.config.seed
    assert not RunLock.is_held(tmp_path / "run")
    Experiment.open(tmp_path / "run").close()


def test_a_killed_process_leaves_no_lock_behind(tmp_path: Path) -> None:
    hold = (
        "import sys, pathlib, os, signal; from sceann_hil.journal import RunLock;"
        "RunLock(pathlib.Path(sys.argv[1])); os.kill(os.getpid(), signal.SIGKILL)"
    )
    subprocess.run([sys.executable, "-c", hold, str(tmp_path)], check=False)
    assert not RunLock.is_held(tmp_path)
    RunLock(tmp_path).release()


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(RunExists):
        Experiment.create(config_of(POLE), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["notes.txt"]


def test_a_void_attempt_has_no_fitness_and_a_trial_is_counted_once(tmp_path: Path) -> None:
    with Experiment.create(config_of(POLE), tmp_path / "run") as experiment:
        journal: Journal = experiment.journal
        journal.begin_generation(0, b"", np.zeros((1, 24), np.uint8), [None], [None])
        starts, noise = np.zeros((1, 4)), np.ones(1, np.uint64)
        slot = lambda attempt: Slots(np.array([0]), np.array([0]), np.array([attempt]))  # noqa: E731
        void = journal.intend(0, slot(0), starts, noise)
        journal.record(void, Results.void(1, EndReason.LINK_LOST, 4), np.array([123.0]))
        assert journal.reader.attempt(int(void[0])).fitness is None
        done = Results(
            np.array([EndReason.FELL], np.uint8), np.array([3]), np.array([1]), np.zeros((1, 4)), np.array([0.06])
        )
        journal.record(journal.intend(0, slot(1), starts, noise), done, np.array([2.0]))
        again = journal.intend(0, slot(2), starts, noise)
        with pytest.raises(sqlite3.IntegrityError):
            journal.record(again, done, np.array([2.0]))
        assert journal.reader.attempt(int(again[0])).end_reason is None

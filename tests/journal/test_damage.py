"""Damage of any kind is noticed, named, and there is a way out of it; nothing that was changed is ever believed."""

from __future__ import annotations

import os
import random
import shutil
import signal
import sqlite3
from pathlib import Path

import pytest

from sceann_hil.errors import NotARun, RunIsDamaged, RunIsNewer, UserError
from sceann_hil.journal import JOURNAL_NAME, JournalReader, verify
from sceann_hil.journal.tables import export_csv
from sceann_hil.journal.verify import examine, require_sound
from sceann_hil.run.experiment import Experiment, Outcome
from tests.runs import GOAL, config_of, contents, evolve

SMALL = (GOAL, "algorithm.population=4", "algorithm.generations=3", "task.headings_deg=[0, 90]")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("damage") / "run"
    evolve(directory, *SMALL)
    return directory


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run whose process was killed, so that its newest transactions are in the write-ahead log only."""
    directory = tmp_path_factory.mktemp("damage") / "run"
    pid = os.fork()
    if pid == 0:
        config = config_of(*SMALL)
        experiment, robot = Experiment.create(config, directory), config.robot.build()
        robot._threads = 1  # type: ignore[attr-defined]
        robot.connect()
        experiment.evolve(robot)
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(pid, 0)
    assert (directory / f"{JOURNAL_NAME}-wal").stat().st_size > 0
    assert examine(directory).damage == ()
    return directory


def everything(directory: Path) -> object:
    """All that a journal's readers tell."""
    reader = JournalReader(directory)
    try:
        generations = reader.generations()
        return (
            reader.run(),
            generations,
            [
                (reader.algorithm_state(g.number), reader.individuals(g.number), reader.attempts(g.number))
                for g in generations
            ],
            reader.champion(),
            reader.sessions(),
            reader.events(),
            reader.spent(),
        )
    finally:
        reader.close()


def test_a_sound_run_is_sound(finished: Path) -> None:
    verdict = examine(finished)
    assert verdict.damage == ()
    assert (verdict.generations, verdict.last_sound, verdict.untouched) == (4, 3, True)


@pytest.mark.parametrize("kind", ["finished", "killed"])
def test_random_flipped_bytes_are_noticed_or_change_nothing(
    kind: str, finished: Path, killed: Path, tmp_path: Path
) -> None:
    source = finished if kind == "finished" else killed
    truth = everything(source)
    rng = random.Random(6)
    noticed = 0
    for number in range(60):
        run = tmp_path / f"{number}"
        shutil.copytree(source, run)
        names = [JOURNAL_NAME] if kind == "finished" else [JOURNAL_NAME, f"{JOURNAL_NAME}-wal"]
        path = run / rng.choice(names)
        data = bytearray(path.read_bytes())
        for _ in range(rng.choice((1, 1, 4))):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
        path.write_bytes(data)
        try:
            damage = examine(run).damage
        except (NotARun, RunIsNewer):
            damage = ("its first page",)
        noticed += bool(damage)
        if damage:
            assert all(len(text) > 10 for text in damage)
            with pytest.raises(UserError):
                require_sound(run)
        try:
            told = everything(run)
        except UserError:
            continue
        assert damage or told == truth
        assert told == truth or damage
    assert noticed > 15


def test_a_lost_or_cut_write_ahead_log_is_noticed(killed: Path, tmp_path: Path) -> None:
    truth = everything(killed)
    rng = random.Random(1)
    size = (killed / f"{JOURNAL_NAME}-wal").stat().st_size
    for number in range(12):
        run = tmp_path / f"{number}"
        shutil.copytree(killed, run)
        log = run / f"{JOURNAL_NAME}-wal"
        if number == 0:
            log.unlink()
        else:
            os.truncate(log, rng.randrange(size - 5000))
        verdict = examine(run)
        if not verdict.damage:
            assert everything(run) == truth  # what was cut off were frames that a later one had overwritten
            continue
        assert "transactions are missing" in verdict.damage[0] or "is damaged" in verdict.damage[0]
        for read in (JournalReader, lambda run: Experiment.open(run)):
            with pytest.raises(RunIsDamaged):
                read(run)


def flip(directory: Path, statement: str) -> None:
    with sqlite3.connect(directory / JOURNAL_NAME) as db:
        db.execute(statement)


@pytest.mark.parametrize(
    ("statement", "place", "last_sound"),
    [
        ("UPDATE attempt SET fitness = fitness + 1e-9 WHERE id = 12", "trial 12 of generation 1", 0),
        ("UPDATE attempt SET noise_key = noise_key + 1 WHERE id = 30", "trial 30 of generation 3", 2),
        ("UPDATE attempt SET end_reason = 'got lost' WHERE id = 30", "trial 30 of generation 3", 2),
        ("UPDATE individual SET fitness = fitness * 1.5 + 1 WHERE id = 6", "individual 6 of generation 1", 0),
        ("UPDATE individual SET genome = 'nothex' WHERE id = 16", "individual 16 of generation 3", 2),
        (
            "UPDATE generation SET algorithm_state = zeroblob(length(algorithm_state)) WHERE number = 2",
            "generation 2",
            1,
        ),
        ("UPDATE generation SET best_fitness = 7 WHERE number = 2", "generation 2", 1),
        ("DELETE FROM attempt WHERE id = 20", "generation 2", 1),
        ("UPDATE start SET start_values = '[0, 0' WHERE id = 1", "start 1", None),
        ("UPDATE run SET config = replace(config, 'seed', 'sead')", "the run itself", None),
        ("UPDATE session SET versions = '{' WHERE id = 1", "session 1", 3),
        ("UPDATE event SET message = message || '!' WHERE id = 1", "event 1", 3),
        ("DROP INDEX individual_by_genome", "", 3),
    ],
)
def test_a_changed_row_is_named_with_the_last_sound_generation(
    statement: str, place: str, last_sound: int | None, finished: Path, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    shutil.copytree(finished, run)
    flip(run, statement)
    if not place:
        assert examine(run).damage == ()
        return
    verdict = examine(run)
    assert any(place in text for text in verdict.damage), verdict.damage
    assert verdict.last_sound == last_sound
    with pytest.raises(RunIsDamaged, match="damaged"):
        Experiment.open(run)


def test_going_back_to_a_sound_generation_gives_the_same_run_and_keeps_the_damaged_file(
    finished: Path, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    shutil.copytree(finished, run)
    flip(run, "UPDATE individual SET fitness = 9 WHERE id = 10")
    with pytest.raises(RunIsDamaged, match="individual 10 of generation 2"):
        Experiment.open(run, from_generation=2)
    with Experiment.open(run, from_generation=1) as experiment, experiment.config.robot.build() as robot:
        assert experiment.evolve(robot) is Outcome.FINISHED
    assert contents(run) == contents(finished)
    assert examine(run).damage == ()
    assert [path.name for path in run.glob("damaged-*.sqlite")] == [f"damaged-1-{JOURNAL_NAME}"]
    assert "went back to generation 1" in str(JournalReader(run).events())


def test_damage_found_while_tables_are_written_leaves_no_table_behind(finished: Path, tmp_path: Path) -> None:
    run = tmp_path / "run"
    shutil.copytree(finished, run)
    flip(run, "UPDATE attempt SET steps = steps + 1 WHERE id = 20")
    with pytest.raises(RunIsDamaged, match="trial 20"):
        export_csv(JournalReader(run), tmp_path / "tables")
    assert not list((tmp_path / "tables").glob("*"))


def test_of_a_long_run_that_was_cut_off_the_newest_generations_are_looked_at(
    killed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verify, "ALL_OF", 10)  # of 4 generations with 8 attempts
    for generation, refused in ((0, False), (1, False), (2, True), (3, True)):
        run = tmp_path / f"{generation}"
        shutil.copytree(killed, run)
        flip(run, f"UPDATE attempt SET steps = steps + 1 WHERE generation = {generation}")
        assert examine(run).damage, "whoever asks for all of it is told"
        if refused:
            with pytest.raises(RunIsDamaged, match=f"of generation {generation}"):
                require_sound(run)
        else:
            require_sound(run)
            with pytest.raises(RunIsDamaged, match="of generation"):
                JournalReader(run).attempts(generation)


def test_figures_of_all_generations_of_a_long_run_are_looked_at(
    killed: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verify, "ALL_OF", 10)
    shutil.copytree(killed, tmp_path / "run")
    flip(tmp_path / "run", "UPDATE generation SET best_fitness = 0.9 WHERE number = 0")
    with pytest.raises(RunIsDamaged, match="generation 0"):
        require_sound(tmp_path / "run")

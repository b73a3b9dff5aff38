"""A study ends with the same numbers however it was interrupted, cut or shared."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from small_study import SMALL, assert_same_results

from sceann_hil.errors import ConfigError, NotARun, RunIsDamaged, RunIsLocked, RunIsNewer, StudyChanged, WorkersLost
from sceann_hil.journal.disk import when_there_is_room
from sceann_hil.journal.insertion import insert_row
from sceann_hil.study import (
    STUDY_NAME,
    Block,
    BlockResult,
    LocalWorkers,
    Observer,
    Study,
    StudyReader,
    StudyStore,
    compute_block,
    parse_study,
    run_study,
)
from sceann_hil.study.local import MOST_DEATHS
from sceann_hil.study.runner import Todo
from sceann_hil.study.schema import columns_of


class Here:
    """Computes in this process, in blocks as for `count` workers, and keeps count."""

    def __init__(self, count: int = 1, stop_after: int | None = None) -> None:
        self.count = count
        self.description = "the test"
        self.done: list[tuple[int, int, int]] = []
        self._stop_after = stop_after

    def compute(self, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        for block in blocks:
            if len(self.done) == self._stop_after:
                raise KeyboardInterrupt
            self.done.append((block.condition, block.first_run, len(block.seeds)))
            yield compute_block(block)


def test_a_study_that_was_interrupted_goes_on_with_the_same_numbers_and_nothing_twice(
    small: Study, tmp_path: Path
) -> None:
    whole, parts = tmp_path / "whole", tmp_path / "parts"
    run_study(small, whole, Here())
    first = Here(count=5, stop_after=4)
    with pytest.raises(KeyboardInterrupt):
        run_study(small, parts, first)
    second = Here(count=2)
    run_study(small, parts, second)
    assert_same_results(whole, parts)
    runs = [(c, run) for c, begin, n in first.done + second.done for run in range(begin, begin + n)]
    assert sorted(runs) == [(c, run) for c in range(4) for run in range(12)]


def test_more_runs_are_added_to_the_old_ones(small: Study, tmp_path: Path) -> None:
    run_study(parse_study(SMALL, "s", ["runs=5"]), tmp_path, Here())
    more = Here()
    run_study(small, tmp_path, more)
    assert {begin for _, begin, _ in more.done} == {5}
    run_study(small, tmp_path / "at once", Here())
    assert_same_results(tmp_path, tmp_path / "at once")


def test_a_dead_worker_s_runs_are_done_again(small: Study, tmp_path: Path) -> None:
    class Killer(Observer):
        kills = 0

        def finished(self, condition: object, result: BlockResult) -> None:
            if self.kills == 0:
                victim = multiprocessing.active_children()[0]
                assert victim.pid is not None
                os.kill(victim.pid, signal.SIGKILL)
                self.kills += 1

    killer = Killer()
    run_study(small, tmp_path / "killed", LocalWorkers(2), killer)
    assert killer.kills == 1
    run_study(small, tmp_path / "calm", Here())
    assert_same_results(tmp_path / "killed", tmp_path / "calm")


def test_workers_that_die_again_and_again_end_the_study(
    small: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sceann_hil.study.local.compute_block", _die)
    with pytest.raises(WorkersLost, match=f"died {MOST_DEATHS + 1} times"):
        run_study(small, tmp_path, LocalWorkers(2))


def _die(_: Block) -> None:
    os._exit(1)


def test_a_killed_process_leaves_a_study_that_goes_on(small: Study, tmp_path: Path) -> None:
    config = tmp_path / "small.yaml"
    config.write_text(SMALL, encoding="utf-8")
    killed = tmp_path / "killed"
    command = [sys.executable, "-m", "sceann_hil.cli", "study", str(config), "--workers", "1", "--out", str(killed)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, start_new_session=True)
    try:
        deadline = time.monotonic() + 60
        while not _some_runs(killed / "small") and time.monotonic() < deadline:
            time.sleep(0.005)
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        if process.stderr:
            process.stderr.close()
    assert _some_runs(killed / "small")
    run_study(small, killed / "small", Here())
    run_study(small, tmp_path / "calm", Here())
    assert_same_results(killed / "small", tmp_path / "calm")


def _some_runs(directory: Path) -> bool:
    if not (directory / STUDY_NAME).exists():
        return False
    with StudyReader(directory) as reader:
        return bool(reader.finished(0))


def change(directory: Path, statement: str) -> None:
    """Change a study's conditions behind its back, checksums and all."""
    with sqlite3.connect(directory / STUDY_NAME) as db:
        db.execute(statement)
        for row in db.execute("SELECT number, identity, settings, config FROM condition").fetchall():
            insert_row(db, "condition", row, replace=True, columns_of=columns_of)


def test_a_changed_configuration_is_refused_with_the_difference(small: Study, tmp_path: Path) -> None:
    run_study(small, tmp_path, Here())
    for old, new, shown in [
        ("max_steps: 400", "max_steps: 500", "base.task.max_steps: 400 -> 500"),
        ("[2, 4]", "[4, 2]", "grid.robot.n_sensors: [2, 4] -> [4, 2]"),
        ("seed: 3", "seed: 4", "seed: 3 -> 4"),
    ]:
        with pytest.raises(StudyChanged) as refused:
            run_study(parse_study(SMALL.replace(old, new), "s"), tmp_path, Here())
        assert shown in refused.value.message


def test_a_default_that_changed_since_is_a_change_too(small: Study, tmp_path: Path) -> None:
    run_study(small, tmp_path, Here())
    change(tmp_path, "UPDATE condition SET config = replace(config, 'tick_s: 0.02', 'tick_s: 0.05')")
    with pytest.raises(StudyChanged, match=r"robot.tick_s: 0.05 -> 0.02"):
        run_study(small, tmp_path, Here())


def test_an_option_that_was_added_since_is_none(small: Study, tmp_path: Path) -> None:
    run_study(small, tmp_path, Here())
    change(tmp_path, "UPDATE condition SET config = replace(config, '  tick_s: 0.02\n', '')")
    nothing = Here()
    run_study(small, tmp_path, nothing)
    assert nothing.done == []


def test_a_full_disk_pauses_the_study_until_there_is_room(small: Study, tmp_path: Path) -> None:
    told: list[str] = []
    with StudyStore.begin_or_continue(small, tmp_path, "the test") as store:
        block = next(Todo.of(small, store).blocks(1))
        result = compute_block(block)
        db = store._db
        size = db.execute("PRAGMA page_count").fetchone()[0]
        db.execute("CREATE TABLE ballast (x BLOB)")
        while (
            db.execute("PRAGMA freelist_count").fetchone()[0] or size != db.execute("PRAGMA page_count").fetchone()[0]
        ):
            size = db.execute("PRAGMA page_count").fetchone()[0]
        db.execute(f"PRAGMA max_page_count = {size}")

        def wait(seconds: float) -> None:
            assert store.finished(block.condition) == set()
            told.append(f"waited {seconds:g} s")
            if len(told) == 3:
                db.execute(f"PRAGMA max_page_count = {size + 1000}")

        fat = BlockResult(block, result.fitness, result.successes, result.genomes, np.tile(result.best, (1, 500)))
        when_there_is_room(lambda: store.record(fat), lambda: told.append("full"), wait)
        assert told == ["full", "waited 10 s", "waited 10 s"]
        assert store.finished(block.condition) == set(range(len(block.seeds)))


def test_any_other_error_of_the_database_is_not_waited_for(small: Study, tmp_path: Path) -> None:
    with StudyStore.begin_or_continue(small, tmp_path, "the test") as store:
        result = compute_block(next(Todo.of(small, store).blocks(1)))
        store._db.execute("DROP TABLE run")
        with pytest.raises(RunIsDamaged, match="no such table"):
            when_there_is_room(lambda: store.record(result), lambda: None, lambda _: None)


def test_two_processes_cannot_write_one_study(small: Study, tmp_path: Path) -> None:
    with (
        StudyStore.begin_or_continue(small, tmp_path, "one"),
        pytest.raises(RunIsLocked),
    ):
        StudyStore.begin_or_continue(small, tmp_path, "other")


def test_what_is_no_study_is_refused(small: Study, tmp_path: Path) -> None:
    with pytest.raises(NotARun, match="holds no study"):
        StudyReader(tmp_path)
    sqlite3.connect(tmp_path / STUDY_NAME).execute("CREATE TABLE t (x)").connection.close()
    with pytest.raises(NotARun, match="not a study of this program"):
        StudyReader(tmp_path)
    with sqlite3.connect(tmp_path / STUDY_NAME) as db:
        db.execute("PRAGMA application_id = 0x5CEA2211")
        db.execute("PRAGMA user_version = 999")
    with pytest.raises(RunIsNewer, match="its schema is 999"):
        run_study(small, tmp_path, Here())


def test_a_robot_that_takes_one_trial_at_a_time_is_refused(
    small: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dataclasses import replace

    robot = type(small.conditions[0].config.robot)
    spec = replace(small.conditions[0].config.robot.spec, batch_size=1, attended=True)
    monkeypatch.setattr(robot, "spec", property(lambda _: spec))
    with pytest.raises(ConfigError, match="a study needs a simulated robot"):
        run_study(small, tmp_path, Here())


def test_workers_end_with_a_parent_that_is_killed(small: Study, tmp_path: Path) -> None:
    """Each holds 230 MB and would wait for work for ever."""
    config = tmp_path / "small.yaml"
    config.write_text(SMALL.replace("runs: 12", "runs: 100000"), encoding="utf-8")
    command = [sys.executable, "-m", "sceann_hil.cli", "study", str(config), "--workers", "2", "--out", str(tmp_path)]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        deadline = time.monotonic() + 60
        while not _some_runs(tmp_path / "small") and time.monotonic() < deadline:
            time.sleep(0.1)
        session = process.pid
        assert len(_of_session(session)) >= 3
        process.kill()
        process.wait()
        deadline = time.monotonic() + 30
        while _of_session(session) and time.monotonic() < deadline:
            time.sleep(0.1)
        assert _of_session(session) == []
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def _of_session(session: int) -> list[int]:
    """Processes of a session that are alive."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == session and fields[0] != "Z":
            found.append(int(path.parent.name))
    return found

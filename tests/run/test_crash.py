"""``kill -9`` at any moment, then resume: the same journal as a run that was never interrupted."""

from __future__ import annotations

import os
import random
import signal
import sqlite3
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from sceann_hil.errors import DiskFull, NotARun
from sceann_hil.journal import intents
from sceann_hil.run.experiment import Experiment, Outcome
from tests.runs import GOAL, POLE, config_of, contents, evolve, resume

TINY_POLE = (POLE, "algorithm.population=3", "algorithm.generations=2")
TINY_GOAL = (GOAL, "algorithm.population=3", "algorithm.generations=2")


def in_a_child(work: Callable[[], object], kill_after_s: float | None = None) -> int:
    """Exit status of a forked process that does `work`, killed after some time."""
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            work()
            status = 0
        finally:
            os._exit(status)
    if kill_after_s is not None:
        time.sleep(kill_after_s)
        os.kill(pid, signal.SIGKILL)
    _, status = os.waitpid(pid, 0)
    return status


def start_or_resume(directory: Path, text: str, *overrides: str) -> None:
    """What a user does after a crash: resume, or start again if there is no run yet."""
    config = config_of(text, *overrides, "robot.type=" + ("cartpole" if text == POLE else "diffdrive"))
    try:
        experiment = Experiment.open(directory)
    except NotARun:
        experiment = Experiment.create(config, directory)
    # one thread: a fork must not inherit a pool
    robot = config.robot.build()
    robot._threads = 1  # type: ignore[attr-defined]
    with experiment, robot:
        assert experiment.evolve(robot) is Outcome.FINISHED


@pytest.mark.parametrize(
    ("case", "large"), [(TINY_POLE, 1000), (TINY_GOAL, 1)], ids=["sga pole, attempts", "oga goal, batches"]
)
def test_killed_at_every_single_statement_of_the_database(
    case: tuple[str, ...], large: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = tmp_path / "whole"
    start_or_resume(whole, *case)
    expected = contents(whole)
    monkeypatch.setattr(intents, "LARGE", large)

    def die_at(n: int, directory: Path) -> None:
        connect = sqlite3.connect

        def counting(*args: object, **kwargs: object) -> sqlite3.Connection:
            db = connect(*args, **kwargs)  # type: ignore[arg-type, call-overload]

            def traced(_: str) -> None:
                nonlocal n
                n -= 1
                if n == 0:
                    os.kill(os.getpid(), signal.SIGKILL)

            db.set_trace_callback(traced)
            return db  # type: ignore[no-any-return]

        sqlite3.connect = counting  # type: ignore[assignment]
        start_or_resume(directory, *case)

    n = 0
    while True:
        n += 1
        directory = tmp_path / f"killed{n}"
        status = in_a_child(lambda n=n, d=directory: die_at(n, d))  # type: ignore[misc]
        if status == 0:
            break
        assert os.WIFSIGNALED(status)
        in_a_child(lambda d=directory: start_or_resume(d, *case))  # type: ignore[misc]
        assert contents(directory) == expected, f"killed at statement {n}"
    assert n > 50


@pytest.mark.parametrize("text", [POLE, GOAL], ids=["sga pole", "oga goal"])
def test_killed_at_many_random_moments(text: str, tmp_path: Path) -> None:
    overrides = ("algorithm.generations=25",)
    whole = tmp_path / "whole"
    start_or_resume(whole, text, *overrides)
    expected = contents(whole)
    started = time.monotonic()
    in_a_child(lambda: start_or_resume(tmp_path / "timed", text, *overrides))
    whole_s = time.monotonic() - started
    moments = random.Random(4)
    kills = 0
    for attempt in range(8):
        directory = tmp_path / f"killed{attempt}"
        while True:
            delay = moments.uniform(0.0, whole_s)
            status = in_a_child(lambda d=directory: start_or_resume(d, text, *overrides), delay)  # type: ignore[misc]
            kills += os.WIFSIGNALED(status)
            if status == 0:
                break
            assert kills < 500
        assert contents(directory) == expected
    assert kills >= 8


def test_resuming_a_finished_run_changes_nothing(tmp_path: Path) -> None:
    evolve(tmp_path / "run")
    before = contents(tmp_path / "run")
    assert resume(tmp_path / "run") is Outcome.FINISHED
    assert contents(tmp_path / "run") == before


def test_a_full_disk_loses_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    evolve(tmp_path / "whole", GOAL)
    config = config_of(GOAL)
    with Experiment.create(config, tmp_path / "run") as experiment, config.robot.build() as robot:
        database = experiment.journal._db
        pages = database.execute("PRAGMA page_count").fetchone()[0]
        database.execute(f"PRAGMA max_page_count = {pages + 2}")
        with pytest.raises(DiskFull, match="full"):
            experiment.evolve(robot)
        assert experiment.journal.reader.count_attempts() > 0
    resume(tmp_path / "run")
    assert contents(tmp_path / "run") == contents(tmp_path / "whole")

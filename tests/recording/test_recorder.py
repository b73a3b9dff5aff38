"""The recorder makes what is missing, and nothing that is wrong."""

from __future__ import annotations

import shutil
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.errors import ExitCode, RecordingIsDamaged, ReplayDiffers, RunIsLocked
from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.recording import Detail, RecorderStatus, RecordingPaths, State, rrd
from sceann_hil.recording.recorder import Recorder
from tests.runs import falsify


def record(run_dir: Path, detail: Detail = Detail.ALL, *, replace_damaged: bool = True) -> list[RecorderStatus]:
    told: list[RecorderStatus] = []
    recorder = Recorder(run_dir, detail, told.append, replace_damaged=replace_damaged)
    try:
        recorder.record()
    finally:
        recorder.close()
    return told


def counts(run_dir: Path) -> dict[int, int]:
    paths = RecordingPaths(run_dir)
    return {number: rrd.check(paths.generation(number), "") for number in paths.recorded_generations()}


def test_every_trial_of_every_generation_is_recorded(run: Path) -> None:
    told = record(run)
    assert counts(run) == {0: 12, 1: 12, 2: 12}
    assert told[-1] == RecorderStatus(State.FINISHED, Detail.ALL, 3, 3, 36)
    assert RecorderStatus.read(RecordingPaths(run).status) == told[-1]


def test_nothing_but_the_recordings_is_left(run: Path) -> None:
    record(run)
    names = sorted(p.relative_to(run).as_posix() for p in (run / "recording").rglob("*") if p.is_file())
    digests = [name for name in names if name.endswith(".sha256")]
    names = [name for name in names if name not in digests]
    assert sorted(name.replace("/.", "/").removesuffix(".sha256") for name in digests) == [
        name for name in names if name.endswith((".rrd", ".rbl"))
    ]
    numbers = ("g000.rrd", "g001.rrd", "g002.rrd")
    assert names == sorted(
        [
            *(f"recording/trials/{n}" for n in numbers),
            *(f"recording/overview/{n}" for n in (*numbers, "start.rrd")),
            *(f"recording/{n}" for n in ("form", "lock", "run.rbl", "run.rrd", "scenery.rrd", "status.json")),
            *(f"recording/{n}" for n in ("table.rbl", "trial.rbl")),
        ]
    )


def test_best_records_the_trials_of_the_best_individuals(run: Path) -> None:
    record(run, Detail.BEST)
    assert counts(run) == {0: 3, 1: 3, 2: 3}


def test_asking_for_more_detail_later_records_again(run: Path) -> None:
    record(run, Detail.BEST)
    record(run, Detail.ALL)
    assert counts(run) == {0: 12, 1: 12, 2: 12}


def test_what_is_there_is_not_made_again(run: Path) -> None:
    record(run)
    paths = RecordingPaths(run)
    before = {n: paths.generation(n).stat().st_mtime_ns for n in range(3)}
    paths.generation(1).unlink()
    assert record(run)[-1].trials == 12
    after = {n: paths.generation(n).stat().st_mtime_ns for n in range(3)}
    assert [after[n] == before[n] for n in range(3)] == [True, False, True]


def test_a_damaged_file_is_made_again(run: Path) -> None:
    record(run)
    path = RecordingPaths(run).generation(1)
    path.write_bytes(path.read_bytes()[:-100])
    record(run)
    assert counts(run) == {0: 12, 1: 12, 2: 12}


def test_a_damaged_file_is_refused_when_it_is_not_to_be_replaced(run: Path) -> None:
    record(run)
    path = RecordingPaths(run).generation(1)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(RecordingIsDamaged, match="cut off"):
        record(run, replace_damaged=False)


@pytest.mark.parametrize("column", ["steps", "state_hash"])
def test_a_trial_that_cannot_be_repeated_is_never_drawn(run: Path, column: str) -> None:
    falsify(run, f"UPDATE attempt SET {column} = {column} + 1 WHERE generation = 1 AND individual = 2")
    with pytest.raises(ReplayDiffers, match=r"generation 1, individual 2.*the journal says"):
        record(run)
    assert 1 not in counts(run)


def test_two_recorders_of_one_run_do_not_meet(run: Path) -> None:
    first = Recorder(run, Detail.ALL)
    with pytest.raises(RunIsLocked):
        Recorder(run, Detail.ALL)
    first.close()
    Recorder(run, Detail.ALL).close()


def test_a_recorder_follows_a_run_that_goes_on(run: Path) -> None:
    with sqlite3.connect(run / JOURNAL_NAME) as journal:
        finished = journal.execute("SELECT finished_at FROM generation WHERE number = 2").fetchone()[0]
        journal.execute("UPDATE generation SET finished_at = NULL WHERE number = 2")
    asked = 0

    def more() -> bool:
        nonlocal asked
        asked += 1
        if asked == 2:
            assert counts(run) == {0: 12, 1: 12}
            with sqlite3.connect(run / JOURNAL_NAME) as journal:
                journal.execute("UPDATE generation SET finished_at = ? WHERE number = 2", (finished,))
        return asked < 3

    recorder = Recorder(run, Detail.ALL)
    recorder.record(more)
    recorder.close()
    assert counts(run) == {0: 12, 1: 12, 2: 12}


def test_a_recorder_that_is_killed_at_any_moment_can_be_started_again(goal_reach: Path, tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    interrupted = 0
    for attempt in range(4):
        run = Path(shutil.copytree(goal_reach, tmp_path / f"run{attempt}"))
        paths = RecordingPaths(run)
        process = subprocess.Popen(
            [sys.executable, "-m", "sceann_hil.recording", str(run)], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        deadline = time.monotonic() + 60.0
        while not paths.scenery.exists() and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.002)
        time.sleep(rng.uniform(0.0, 0.25))
        interrupted += process.poll() is None
        process.kill()
        process.communicate()
        for path in paths.folder.rglob("*.rrd"):
            if not any(part.startswith(".") for part in path.relative_to(run).parts):
                rrd.check(path, "")  # whatever has its name is whole
        record(run)
        assert counts(run) == {0: 12, 1: 12, 2: 12}
        assert rrd.check(paths.run, "") == 1
        hidden = [p for p in paths.folder.rglob("*") if p.name.startswith(".")]
        assert all(p.suffix == ".sha256" and p.with_name(p.name[1:-7]).exists() for p in hidden)
    assert interrupted, "no recorder was killed in the middle of its work"


def test_a_folder_that_is_no_run_has_its_exit_code_and_no_traceback(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "sceann_hil.recording", str(tmp_path)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == ExitCode.NOT_A_RUN
    assert "is not a run" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("form", [None, "1\n"])
def test_recordings_of_another_form_are_drawn_again(form: str | None, run: Path) -> None:
    record(run)
    paths = RecordingPaths(run)
    before = paths.generation(1).stat().st_ino
    record(run)
    assert paths.generation(1).stat().st_ino == before
    paths.form.unlink()
    if form is not None:
        paths.form.write_text(form)
    record(run)
    assert paths.generation(1).stat().st_ino != before
    assert counts(run) == {0: 12, 1: 12, 2: 12}
    assert rrd.check(paths.run, "") == 1

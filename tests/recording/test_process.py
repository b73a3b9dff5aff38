"""The recorder process as the experiment sees it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

import sceann_hil
from sceann_hil.cli import app
from sceann_hil.errors import RunIsLocked
from sceann_hil.journal import JournalReader, RunLock
from sceann_hil.recording import Detail, RecorderProcess, RecorderStatus, RecordingPaths, State, view
from sceann_hil.recording.process import status_now, wait_for_recorder
from sceann_hil.run.experiment import Experiment
from tests.runs import POLE, falsify
from tests.terminal import terminal


def wait_for(condition: Callable[[], bool], timeout_s: float = 60.0) -> None:
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.02)


def test_the_parent_imports_neither_rerun_nor_numba() -> None:
    code = "import sys, sceann_hil, sceann_hil.recording; print(sorted({'rerun', 'numba'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_finish_waits_until_everything_is_recorded(run: Path) -> None:
    recorder = RecorderProcess(run, Detail.ALL)
    recorder.start()
    status = recorder.finish()
    assert (status.state, status.generations, status.trials, status.message) == (State.FINISHED, 3, 36, "")
    assert RecordingPaths(run).recorded_generations() == [0, 1, 2]
    assert RecordingPaths(run).log.read_text() == ""


def test_finish_with_a_limit_leaves_the_recorder_at_work(run: Path) -> None:
    recorder = RecorderProcess(run, Detail.ALL)
    recorder.start()
    assert recorder.finish(timeout_s=0.0).state in (State.STARTING, State.RECORDING)
    wait_for(lambda: recorder.poll().state is State.FINISHED)


def test_a_recorder_that_dies_is_reported_and_does_not_raise(run: Path) -> None:
    recorder = RecorderProcess(run, Detail.BEST)
    recorder.start()
    assert recorder._process is not None
    os.kill(recorder._process.pid, signal.SIGKILL)
    wait_for(lambda: recorder.poll().state is State.FAILED)
    assert "ended early" in recorder.poll().message
    assert recorder.finish().state is State.FAILED


def test_a_wrong_replay_stops_the_recorder_with_a_message(run: Path) -> None:
    falsify(run, "UPDATE attempt SET state_hash = state_hash + 1 WHERE id = 14")
    recorder = RecorderProcess(run, Detail.ALL)
    recorder.start()
    status = recorder.finish()
    assert status.state is State.FAILED
    assert "Trial 14 (generation 1" in status.message
    log = RecordingPaths(run).log.read_text()
    assert "Trial 14 (generation 1" in log
    assert "Traceback" not in log


def test_a_recorder_ends_after_its_parent_was_killed(run: Path) -> None:
    code = (
        "import sys, time; from pathlib import Path; from sceann_hil.recording import Detail, RecorderProcess\n"
        "RecorderProcess(Path(sys.argv[1]), Detail.ALL).start(); print('started', flush=True); time.sleep(600)"
    )
    parent = subprocess.Popen([sys.executable, "-c", code, str(run)], stdout=subprocess.PIPE)
    assert parent.stdout is not None
    assert parent.stdout.readline() == b"started\n"
    parent.kill()
    parent.communicate()
    observer = RecordingPaths(run)
    wait_for(lambda: observer.status.exists() and '"finished"' in observer.status.read_text())
    assert observer.recorded_generations() == [0, 1, 2]


def test_a_recorder_of_the_next_session_waits_for_the_one_before(run: Path) -> None:
    """Regression: with a recorder left in the background, `resume` had one that gave up at once."""
    recorders = [RecorderProcess(run, Detail.ALL) for _ in range(2)]
    for recorder in recorders:
        recorder.start()
    for recorder in recorders:
        recorder.finish(timeout_s=0.0)
    assert [recorder.finish().state for recorder in recorders] == [State.FINISHED, State.FINISHED]
    assert RecordingPaths(run).recorded_generations() == [0, 1, 2]


def test_whoever_needs_recordings_waits_for_the_recorder_and_is_told_how_far_it_is(run: Path) -> None:
    recorder = RecorderProcess(run, Detail.ALL)
    recorder.start()
    recorder.finish(timeout_s=0.0)
    with view.prepared(run, view.OVERVIEW) as source:
        assert Path(source) == RecordingPaths(run).run
    assert recorder.finish().state is State.FINISHED
    status = status_now(run)
    assert status is not None
    assert status.words == "finished, 3 of 3 generations"


def test_a_run_that_goes_on_is_not_waited_for(run: Path) -> None:
    told: list[RecorderStatus] = []
    RecordingPaths(run).folder.mkdir()
    with RunLock(RecordingPaths(run).folder):
        assert wait_for_recorder(run, told.append, enough=lambda: bool(told)) is False
        assert len(told) == 1
        with RunLock(run):
            assert wait_for_recorder(run, told.append) is False
    assert len(told) == 1
    assert wait_for_recorder(run, told.append) is True


def test_a_recorder_that_was_killed_is_not_said_to_be_at_work(run: Path) -> None:
    assert status_now(run) is None
    paths = RecordingPaths(run)
    paths.folder.mkdir()
    RecorderStatus(State.STARTING).write(paths.status)
    assert (status := status_now(run)) is not None
    assert status.state is State.STARTING
    os.utime(paths.status, (0, 0))
    assert (status := status_now(run)) is not None
    assert status.state is State.FAILED
    RecorderStatus(State.RECORDING, generations=1, known=3).write(paths.status)
    assert (status := status_now(run)) is not None
    assert status.words == "stopped, 1 of 3 generations: `sceann record` makes the rest"
    with RunLock(paths.folder):
        assert (status := status_now(run)) is not None
        assert status.words == "at work, 1 of 3 generations so far"


def test_evolve_lets_go_of_the_terminal_and_everything_is_recorded(tmp_path: Path) -> None:
    (tmp_path / "pole.yaml").write_text(POLE)
    run = tmp_path / "run"
    with terminal(["evolve", "pole.yaml", "--out", "run"], tmp_path) as shown:
        assert shown.wait() == 0
    assert "nobody has to wait for it" in " ".join(shown.shown.split())
    # the terminal is closed, and so is the process
    assert CliRunner().invoke(app, ["record", str(run)], catch_exceptions=False).exit_code == 0
    assert RecordingPaths(run).recorded_generations() == [0, 1, 2, 3, 4]
    assert (
        json.loads(CliRunner().invoke(app, ["status", str(run), "--json"]).stdout)["recording"]["state"] == "finished"
    )


def test_no_generation_is_forgotten_while_it_is_being_drawn(run: Path) -> None:
    paths = RecordingPaths(run)
    paths.folder.mkdir()
    with RunLock(paths.folder), pytest.raises(RunIsLocked, match="recording is in use"):
        Experiment.open(run, from_generation=1)
    assert len(JournalReader(run).generations()) == 3


def test_stop_ends_it_at_once(run: Path) -> None:
    recorder = RecorderProcess(run, Detail.ALL)
    recorder.start()
    recorder.stop()
    assert recorder.poll().state in (State.FAILED, State.FINISHED)


def test_no_other_package_imports_rerun() -> None:
    root = Path(sceann_hil.__file__).parents[1]
    found = {
        path.relative_to(root).as_posix()
        for package in ("sceann_hil", "backends")
        for path in (root / package).rglob("*.py")
        if re.search(r"^\s*(import|from) rerun", path.read_text(), re.MULTILINE)
    }
    assert found
    assert all(name.startswith("sceann_hil/recording/") for name in found), found

"""The recorder process as the experiment sees it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import sceann_hil
from sceann_hil.recording import Detail, RecorderProcess, RecordingPaths, State
from tests.runs import falsify


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

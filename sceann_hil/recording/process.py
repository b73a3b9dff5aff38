"""The recorder as a process of its own, seen from the experiment: started, asked how far it is, ended.

Nothing here imports rerun or a robot: the evolution pays nothing for being recorded.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from sceann_hil.journal.lock import RunLock
from sceann_hil.recording.paths import RecordingPaths

if sys.platform == "win32":
    APART: dict[str, Any] = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
else:
    APART: dict[str, Any] = {"start_new_session": True}
"""How a process is started that Ctrl-C in the terminal does not reach."""
_LOOK_AGAIN_S = 0.2
_STARTS_WITHIN_S = 60.0
"""A recorder that has not begun by then was killed before."""


class Detail(StrEnum):
    """Which trials are recorded."""

    ALL = "all"
    """Every trial."""
    BEST = "best"
    """The trials of each generation's best individual."""


class State(StrEnum):
    """What a recorder is doing."""

    STARTING = "starting"
    """It has not recorded anything yet."""
    RECORDING = "recording"
    """It makes recordings, or waits for the next generation."""
    FINISHED = "finished"
    """Everything is recorded."""
    FAILED = "failed"
    """It stopped; the message says why. The run goes on without it."""


@dataclass(frozen=True, slots=True)
class RecorderStatus:
    """How far a recorder is.

    Attributes:
        state: what it is doing.
        detail: which trials it records.
        generations: how many are recorded.
        known: how many there were to record when it last looked.
        trials: how many it has recorded since it started.
        message: why it failed.
    """

    state: State = State.STARTING
    detail: Detail = Detail.ALL
    generations: int = 0
    known: int = 0
    trials: int = 0
    message: str = ""

    def write(self, path: Path) -> None:
        """As JSON, whole or not at all; on a full disk the last one stays."""
        part = path.with_name(f".{path.name}.part")
        with contextlib.suppress(OSError):
            part.write_text(json.dumps(asdict(self)))
            part.replace(path)

    @classmethod
    def read(cls, path: Path) -> RecorderStatus | None:
        """The inverse of `write`; None if there is none."""
        try:
            data = json.loads(path.read_text())
            return cls(**{**data, "state": State(data["state"]), "detail": Detail(data["detail"])})
        except (OSError, ValueError, TypeError, KeyError):
            return None

    @property
    def words(self) -> str:
        """For people."""
        done = f"{self.generations} of {self.known} generations"
        return {
            State.STARTING: "about to begin",
            State.RECORDING: f"at work, {done} so far",
            State.FINISHED: f"finished, {done}",
            State.FAILED: f"stopped, {done}: {self.message}",
        }[self.state]


def status_now(run_dir: Path) -> RecorderStatus | None:
    """How far a run's recorder is, whoever started it; None if the run was never recorded."""
    paths = RecordingPaths(run_dir)
    status = RecorderStatus.read(paths.status)
    if status is None or status.state in (State.FINISHED, State.FAILED) or RunLock.is_held(paths.folder):
        return status
    begun = status.state is State.RECORDING or time.time() - paths.status.stat().st_mtime > _STARTS_WITHIN_S
    if begun and not RunLock.is_held(run_dir):
        return replace(status, state=State.FAILED, message="`sceann record` makes the rest")
    return status


def wait_for_recorder(
    run_dir: Path, report: Callable[[RecorderStatus], None], enough: Callable[[], bool] = lambda: False
) -> bool:
    """Wait until a recorder that is at work has ended, unless its run still goes on.

    Args:
        run_dir: the run.
        report: told how far it is.
        enough: ends the waiting.

    Returns:
        Whether nobody records the run any more.
    """
    paths = RecordingPaths(run_dir)
    while RunLock.is_held(paths.folder):
        if RunLock.is_held(run_dir) or enough():
            return False
        report(RecorderStatus.read(paths.status) or RecorderStatus())
        time.sleep(_LOOK_AGAIN_S)
    return True


class RecorderProcess:
    """A recorder beside a running experiment, with low priority.

    It follows the journal. When the experiment says `finish`, or dies, it records what is left and ends: nobody has to
    wait for it, and no terminal has to stay open. It has a session of its own, and never more to do than the journal
    holds.

    Args:
        run_dir: the run; its journal exists.
        detail: which trials.
    """

    def __init__(self, run_dir: Path, detail: Detail = Detail.ALL) -> None:
        self._run_dir = run_dir
        self._paths = RecordingPaths(run_dir)
        self._detail = detail
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Start it; what goes wrong in it later is in its log and its status, never here."""
        self._paths.folder.mkdir(exist_ok=True)
        RecorderStatus(detail=self._detail).write(self._paths.status)
        with self._paths.log.open("ab") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "sceann_hil.recording", str(self._run_dir), "--record", self._detail.value],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                **APART,
            )
        step_back(self._process.pid)

    def poll(self) -> RecorderStatus:
        """How far it is."""
        ended = self._process is None or self._process.poll() is not None
        status = RecorderStatus.read(self._paths.status) or RecorderStatus(detail=self._detail)
        if ended and status.state in (State.STARTING, State.RECORDING):
            return RecorderStatus(
                State.FAILED,
                self._detail,
                status.generations,
                status.known,
                status.trials,
                f"the recorder ended early; see {self._paths.log}",
            )
        return status

    def finish(self, timeout_s: float | None = None) -> RecorderStatus:
        """No more generations will come: wait until everything is recorded.

        Args:
            timeout_s: after this time the recorder is left to finish by itself; None for no limit.
        """
        if self._process is not None:
            if self._process.stdin is not None:
                self._process.stdin.close()
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(timeout_s)
        return self.poll()

    def stop(self) -> None:
        """End it at once; what it has not recorded can be made later."""
        if self._process is not None:
            self._process.terminate()
            if self._process.stdin is not None:
                self._process.stdin.close()
            self._process.wait()


def step_back(process: int) -> None:
    """Let a process run on what others leave over, from its first moment on, as far as the system knows how."""
    with contextlib.suppress(OSError):
        if sys.platform != "win32":
            os.setpriority(os.PRIO_PROCESS, process, 19)
        if sys.platform == "linux":
            os.sched_setscheduler(process, os.SCHED_IDLE, os.sched_param(0))

"""The recorder as a process of its own, seen from the experiment: started, asked how far it is, ended.

Nothing here imports rerun or a robot: the evolution pays nothing for being recorded.
"""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from sceann_hil.recording.paths import RecordingPaths

if sys.platform == "win32":
    APART: dict[str, Any] = {"creationflags": subprocess.CREATE_NEW_PROCESS_GROUP}
else:
    APART: dict[str, Any] = {"start_new_session": True}
"""How a process is started that Ctrl-C in the terminal does not reach."""


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


class RecorderProcess:
    """A recorder beside a running experiment, with low priority.

    It follows the journal. When the experiment says `finish`, or dies, it records what is left and ends.

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

"""The live view seen from the robot's loop: steps go into a pipe, and whatever does not fit is dropped and counted.

Nothing here can wait: a viewer that is absent, stalled or killed costs the loop one failed write. Nothing here imports
rerun.
"""

from __future__ import annotations

import contextlib
import os
import struct
import subprocess
import sys
from enum import IntEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import ToolMissing
from sceann_hil.recording.paths import RecordingPaths
from sceann_hil.recording.process import APART, step_back

HEADER = struct.Struct("<BIHBB")
"""Kind, attempt id, step, sensors that follow (uint16), state values that follow (float32)."""
SPAWN = "spawn"
"""Show in a viewer that is opened for it."""


class FeedKind(IntEnum):
    """What a record says."""

    BEGIN = 1
    STEP = 2
    END = 3


def _needs_pipes_that_do_not_wait() -> None:
    if sys.platform == "win32" and sys.version_info < (3, 12):
        raise ToolMissing("--live needs Python 3.12 or newer on Windows.", "Leave --live out, or use a newer Python.")


class LiveFeed:
    """A `sceann_hil.robot.TrialObserver` that passes everything on to a process with the viewer.

    Attributes:
        dropped: records that did not fit the pipe.

    Args:
        run_dir: the run; its journal exists.
        target: `SPAWN`, the URL of a running viewer, or a file that ends with ``.rrd``.

    Raises:
        ToolMissing: on Windows with an old Python.
    """

    def __init__(self, run_dir: Path, target: str = SPAWN) -> None:
        _needs_pipes_that_do_not_wait()
        self.dropped = 0
        paths = RecordingPaths(run_dir)
        paths.folder.mkdir(exist_ok=True)
        self._log = paths.folder / "live.log"
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "sceann_hil.recording.live", str(run_dir), target],
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=log,
                **APART,
            )
        step_back(self._process.pid)
        if self._process.stdin is None:
            raise RuntimeError("the live view has no standard input")
        self._pipe = self._process.stdin
        if sys.platform != "win32" or sys.version_info >= (3, 12):
            os.set_blocking(self._pipe.fileno(), False)
        self._trial_id = 0

    @property
    def failure(self) -> str:
        """Why nothing is shown any more, in the words of the process with the viewer; empty as long as it runs."""
        if self._process.poll() is None:
            return ""
        said = [line.strip() for line in self._log.read_text(errors="replace").splitlines() if line.strip()]
        return f"{said[-1] if said else f'exit code {self._process.returncode}'} (all of it is in {self._log})"

    @property
    def pid(self) -> int:
        """The process with the viewer."""
        return self._process.pid

    def begin(self, trial_id: int) -> None:
        """A trial starts."""
        self._trial_id = trial_id
        self._write(HEADER.pack(FeedKind.BEGIN, trial_id, 0, 0, 0))

    def step(self, step: int, sensors: NDArray[np.uint16], state: NDArray[np.float32]) -> None:
        """What the controller saw in a step, and the body's state before it where that is known."""
        header = HEADER.pack(FeedKind.STEP, self._trial_id, step & 0xFFFF, len(sensors), len(state))
        self._write(header + sensors.astype("<u2").tobytes() + state.astype("<f4").tobytes())

    def end(self) -> None:
        """The trial is over."""
        self._write(HEADER.pack(FeedKind.END, self._trial_id, 0, 0, 0))

    def _write(self, record: bytes) -> None:
        # a record is smaller than PIPE_BUF: the pipe takes all of it or nothing
        try:
            os.write(self._pipe.fileno(), record)
        except (BlockingIOError, BrokenPipeError, ValueError):
            self.dropped += 1

    def close(self, timeout_s: float = 2.0) -> None:
        """No more trials. The viewer stays open; the process that feeds it ends, or is ended."""
        with contextlib.suppress(OSError):
            self._pipe.close()
        try:
            self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

"""``python -m sceann_hil.recording.live RUN_DIR TARGET``: the process behind `LiveFeed`.

Every trial gets a recording of its own in the viewer. Curves grow while the robot moves; the network computes here
again what it computes on the robot. When the trial is over, the whole of it is drawn.
"""

from __future__ import annotations

import os
import queue
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from sceann_hil.network.controller import ONE, Controller, sensors_to_q10
from sceann_hil.recording import blueprints, chunks
from sceann_hil.recording.columns import scalars, times_of
from sceann_hil.recording.feed import HEADER, SPAWN, FeedKind
from sceann_hil.recording.source import RunSource
from sceann_hil.recording.trial import RecordedTrial, recording_id
from sceann_hil.robot import EndReason, Trace

FRAME_S = 0.1
"""Steps are sent to the viewer so often."""
_SLOW_BYTES = 4096
"""Whoever sends less at a time is paced, and can wait in the pipe for a frame."""


class LiveTrial:
    """The running trial."""

    def __init__(self, source: RunSource, trial_id: int, target: str) -> None:
        run = source.run
        self.row = source.attempt(trial_id)
        self._run, self._weights = run, source.weights_of(self.row)
        self._controller = Controller(self._weights, run.size, source.dynamics)
        self._sensors: list[NDArray[np.uint16]] = []
        self._states: list[NDArray[np.float32]] = []
        self._u: list[NDArray[np.int16]] = []
        self._x: list[NDArray[np.int16]] = []
        self._sent = 0
        row = self.row
        name = recording_id(f"{run.name}-live", row.own_generation, row.individual, row.trial, row.attempt)
        self._stream = rr.RecordingStream(run.experiment, recording_id=name)
        if target == SPAWN:
            self._stream.spawn()
        elif target.endswith(".rrd"):
            self._stream.save(Path(target).with_stem(f"{Path(target).stem}-{trial_id}"))
        else:
            self._stream.connect_grpc(target)
        self._stream.send_blueprint(blueprints.trial_blueprint(run))
        self._stream.send_recording_name(f"live: trial {trial_id}")
        self._stream.send_chunks(list(chunks.shared_chunks(run)))

    def step(self, step: int, sensors: NDArray[np.uint16], state: NDArray[np.float32]) -> None:
        """Take one step; after a dropped one the network's state is not known any more, and nothing is shown."""
        if step != len(self._sensors):
            return
        self._controller.step(sensors)
        self._sensors.append(sensors)
        self._states.append(state)
        self._u.append(self._controller.u)
        self._x.append(self._controller.x)

    def send(self) -> None:
        """Show the steps since the last time."""
        first, self._sent = self._sent, len(self._sensors)
        if first == self._sent:
            return
        times = times_of(np.arange(first, self._sent), self._run.tick_s)
        x, n_hidden = np.array(self._x[first:]), self._run.size.n_hidden
        curves = [
            ("/signals/sensors", sensors_to_q10(np.array(self._sensors[first:])) / ONE),
            ("/signals/motors", x[:, n_hidden:] / ONE),
        ]
        if n_hidden:
            curves.append(("/signals/hidden", x[:, :n_hidden] / ONE))
        for path, values in curves:
            self._stream.send_columns(path, indexes=times, columns=scalars(values))

    def end(self) -> None:
        """Draw the whole trial."""
        self.send()
        if self._sensors:
            states = np.array([*self._states, self._states[-1]], np.float32)
            trace = Trace(states, np.array(self._sensors), np.array(self._u), np.array(self._x))
            # how it ended is hardly ever in the journal when it begins here
            reason = self.row.end_reason or EndReason.TIME_UP
            trial = RecordedTrial.of(self.row, reason, trace, self._weights, champion=False)
            self._stream.send_chunks(list(chunks.trial_chunks(self._run, trial, full=True)))
        self._stream.flush()
        self._stream.disconnect()


def _wait(descriptor: int, come: queue.Queue[bytes]) -> None:
    data = b"-"
    while data:
        data = os.read(descriptor, 65536)
        come.put(data)


def records(descriptor: int) -> Iterator[tuple[FeedKind, int, int, bytes, int] | None]:
    """Records from a pipe until it ends; None when a frame's time has passed without one."""
    # a thread waits for the pipe, because Windows cannot say whether something has come
    come: queue.Queue[bytes] = queue.Queue(1)
    threading.Thread(target=_wait, args=(descriptor, come), name="feed", daemon=True).start()
    buffer = b""
    while True:
        try:
            data = come.get(timeout=FRAME_S)
        except queue.Empty:
            yield None
            continue
        if not data:
            return
        buffer += data
        while len(buffer) >= HEADER.size:
            kind, trial_id, step, n_sensors, n_state = HEADER.unpack_from(buffer)
            whole = HEADER.size + 2 * n_sensors + 4 * n_state
            if len(buffer) < whole:
                break
            payload, buffer = buffer[HEADER.size : whole], buffer[whole:]
            yield FeedKind(kind), trial_id, step, payload, n_sensors
        yield None
        if len(data) < _SLOW_BYTES:
            # a robot's steps come one by one: woken by each of them, the viewer would disturb the loop that sends them
            time.sleep(FRAME_S)


def main() -> int:
    """Show trials until the pipe ends."""
    run_dir, target = Path(sys.argv[1]), sys.argv[2]
    source = RunSource(run_dir)
    trial: LiveTrial | None = None
    for record in records(sys.stdin.fileno()):
        if record is None:
            if trial is not None:
                trial.send()
            continue
        kind, trial_id, step, payload, n_sensors = record
        if kind is FeedKind.BEGIN:
            trial = LiveTrial(source, trial_id, target)
        elif trial is not None and trial.row.id == trial_id:
            if kind is FeedKind.STEP:
                sensors = np.frombuffer(payload, "<u2", n_sensors).astype(np.uint16)
                trial.step(step, sensors, np.frombuffer(payload, "<f4", offset=2 * n_sensors).astype(np.float32))
            else:
                trial.end()
                trial = None
    source.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())

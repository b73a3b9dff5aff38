"""``python -m sceann_hil.recording RUN_DIR``: the recorder process that `RecorderProcess` starts.

It follows the run until its standard input ends, records what is left, and leaves with the exit codes of
``docs/exit-codes.md``.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sceann_hil.errors import RunIsLocked, as_user_error
from sceann_hil.recording.paths import RecordingPaths
from sceann_hil.recording.process import Detail, RecorderStatus, State

if TYPE_CHECKING:
    from sceann_hil.recording.recorder import Recorder

_LOOK_AGAIN_S = 0.2
_HEAD_START_S = 3.0
"""What the evolution has both cores for before anything is recorded."""


def main() -> int:
    """Record until there is nothing more to come."""
    parser = argparse.ArgumentParser(prog="python -m sceann_hil.recording", description=__doc__)
    parser.add_argument("run_dir", type=Path)
    parser.add_argument("--record", type=Detail, choices=list(Detail), default=Detail.ALL)
    arguments = parser.parse_args()
    status_path = RecordingPaths(arguments.run_dir).status
    told = RecorderStatus(detail=arguments.record)

    def tell(status: RecorderStatus) -> None:
        nonlocal told
        told = status

    ended = threading.Event()
    threading.Thread(target=_wait_for_end, args=(ended,), daemon=True).start()
    # rerun takes a second of a core to import; a short run is over by then, and a long one does not notice
    ended.wait(_HEAD_START_S)
    try:
        from sceann_hil.recording.recorder import Recorder

        recorder = _next_recorder(partial(Recorder, arguments.run_dir, arguments.record, tell))
        try:
            recorder.record(more=lambda: not ended.is_set())
        finally:
            recorder.close()
    except Exception as error:
        user_error = as_user_error(error)
        message = str(user_error) if user_error else f"{type(error).__name__}: {error}"
        print(message, file=sys.stderr, flush=True)
        RecorderStatus(State.FAILED, told.detail, told.generations, told.known, told.trials, message).write(status_path)
        if user_error is None:
            raise
        return int(user_error.exit_code)
    return 0


def _next_recorder(make: Callable[[], Recorder]) -> Recorder:
    """A recorder, as soon as the one of an earlier session has ended."""
    while True:
        try:
            return make()
        except RunIsLocked:
            time.sleep(_LOOK_AGAIN_S)


def _wait_for_end(ended: threading.Event) -> None:
    # os.read and not sys.stdin: a thread inside a buffered reader would stop the interpreter from ending
    with contextlib.suppress(OSError):
        while os.read(0, 4096):
            pass
    ended.set()


if __name__ == "__main__":
    sys.exit(main())

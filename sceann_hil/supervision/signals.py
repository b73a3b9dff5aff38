"""Signals while a robot works: the robot stops first, then the run ends in good order, or waits.

=========  =====================================================================================================
SIGINT     Ctrl-C. The first one asks for an end soon, the second one stops the robot and ends at once.
SIGTERM    Stops the robot and ends at once; so does SIGHUP, when the terminal is closed.
SIGTSTP    Ctrl-Z. Stops the robot, and then this process until it is continued; the run then pauses if anybody
           is there who can end the pause.
=========  =====================================================================================================

A thread of its own reads the signals, so that they are obeyed also while a driver blocks the main thread, and so that
nothing of a robot's is ever called in the middle of itself.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sceann_hil.robot import Robot
from sceann_hil.supervision.operators import Desk, Phase
from sceann_hil.supervision.stopping import StopRequest

_HANDLED = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGTSTP") if hasattr(signal, name))
_ENDING = tuple(number for number in _HANDLED if number.name in ("SIGTERM", "SIGHUP"))
SAFE_S = 3.0
"""How long a stopping process waits for the trial that it cut off."""


class Signals:
    """What the signals that came so far ask for.

    Args:
        first: what the first Ctrl-C asks for.
        tell: says something to the person at the command line.
        soon: what the first Ctrl-C waits for, in words.
    """

    def __init__(
        self,
        tell: Callable[[str], object],
        *,
        first: StopRequest = StopRequest.NOW,
        soon: Callable[[], str] = lambda: "Stopping before the next trial.",
    ) -> None:
        self._tell = tell
        self._first = first
        self._soon = soon
        self._request = StopRequest.NONE
        self._interrupts = 0
        self._came: Counter[int] = Counter()
        # asked now: a terminal that was closed is none any more
        self._terminals = [descriptor for descriptor in (1, 2) if os.isatty(descriptor)]
        self._robot: Robot | None = None
        self._desk: Desk | None = None

    def request(self) -> StopRequest:
        """What is asked for; to be given to a desk and a run."""
        return self._request

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Obey signals during the block. In another thread than the main one, nothing is changed."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        # sockets, because Windows cannot write to a pipe without waiting
        reading, writing = socket.socketpair()
        writing.setblocking(False)
        before = {number: signal.signal(number, self._at_last) for number in _HANDLED}
        waking = signal.set_wakeup_fd(writing.fileno(), warn_on_full_buffer=False)
        reader = threading.Thread(target=self._read, args=(reading,), name="signals", daemon=True)
        reader.start()
        try:
            yield
        finally:
            signal.set_wakeup_fd(waking)
            for number, handler in before.items():
                signal.signal(number, handler)
            writing.close()
            reader.join()
            reading.close()

    def guard(self, robot: Robot, desk: Desk) -> None:
        """From now on there is a robot that must stop first."""
        self._robot, self._desk = robot, desk

    def _at_last(self, number: int, _: object) -> None:
        """In the main thread: the third of them does not wait for anything."""
        self._came[number] += 1
        if number == signal.SIGINT and self._came[number] > 2:
            raise KeyboardInterrupt
        if number in _ENDING and self._came[number] > 2:
            raise SystemExit(128 + number)

    def _read(self, reading: socket.socket) -> None:
        while numbers := reading.recv(64):
            for number in numbers:
                self._obey(number)

    def _obey(self, number: int) -> None:
        if number == signal.SIGINT:
            self._interrupts += 1
            if self._interrupts == 1:
                self._request = self._first
                self._tell(f"{self._soon()} Press Ctrl-C again to stop now.")
            elif self._interrupts == 2:
                self._stop_now(StopRequest.NOW, "Ctrl-C", "Stopping now: the robot first. A trial that runs is void.")
            return
        name = signal.Signals(number).name
        if name == "SIGTSTP":
            self._stop_process()
        elif name == "SIGTERM":
            self._stop_now(StopRequest.TERMINATED, name, "Stopping now, as the system asks: the robot first.")
        elif name == "SIGHUP":
            self._leave_terminal()
            self._stop_now(StopRequest.HUNG_UP, name, "")

    def _stop_now(self, request: StopRequest, why: str, text: str) -> None:
        self._request = request
        if self._desk is not None:
            self._desk.cut_off(f"stopped by {why}")
        if text:
            self._tell(text)

    def _leave_terminal(self) -> None:
        """Nobody reads there any more: whatever is still printed must not end the run with an error."""
        with contextlib.suppress(OSError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            for descriptor in self._terminals:
                os.dup2(nowhere, descriptor)
            os.close(nowhere)

    def _stop_process(self) -> None:
        if self._desk is not None and self._robot is not None:
            self._desk.hold(True)
            self._desk.cut_off("stopped by Ctrl-Z")
            self._desk.pause("Ctrl-Z")
            deadline = time.monotonic() + SAFE_S
            while self._desk.view().phase is Phase.RUNNING and time.monotonic() < deadline:
                time.sleep(0.02)
            self._robot.make_safe("Ctrl-Z")
        if sys.platform != "win32":
            os.kill(os.getpid(), signal.SIGSTOP)
        if self._desk is not None:
            self._desk.hold(False)

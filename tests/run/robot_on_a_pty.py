"""A robot that answers lines of text on a pseudo-terminal, and a `sceann` that drives it from another one."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import re
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

CONFIG = """
name: rover
task: {{type: goal_reach, max_steps: 200, start_m: [0.1, 0.1], headings_deg: [0, 90]}}
robot:
  type: text_line
  port: {port}
  tick_s: 0.05
  answer_s: 1.0
  start_fields: [x_m, y_m, heading_rad]
  sense: {{say: s, answer: "{{}} {{}} {{}}"}}
  sensors: [{{at_0: 0, at_1: 1023}}, {{at_0: 0, at_1: 1023}}, {{at_0: 0, at_1: 1023}}]
  drive: {{say: "m {{}} {{}}", answer: ok}}
  motors: [{{at_0: 0, at_1: 255}}, {{at_0: 0, at_1: 255}}]
  stop: {{say: m 0 0, answer: ok}}
controller: {{coding: sceann3, n_hidden: 2}}
algorithm: {{type: sga, population: 3, generations: 2}}
"""


class Rover:
    """It drives until it is told something else, and remembers every command.

    Attributes:
        commands: every line that was not about sensors, as it came.
    """

    def __init__(self) -> None:
        self._line, self._far = pty.openpty()
        attributes = termios.tcgetattr(self._far)
        attributes[3] &= ~(termios.ECHO | termios.ICANON)
        termios.tcsetattr(self._far, termios.TCSANOW, attributes)
        self.port = os.ttyname(self._far)
        self.commands: list[str] = []
        self._thread = threading.Thread(target=self._serve, daemon=True)

    @property
    def drives(self) -> bool:
        """Its last command was to move."""
        return bool(self.commands) and self.commands[-1] != "m 0 0"

    def _serve(self) -> None:
        rest = b""
        with contextlib.suppress(OSError):
            while data := os.read(self._line, 1000):
                *lines, rest = (rest + data).split(b"\n")
                for line in lines:
                    text = line.decode().strip()
                    if text == "s":
                        os.write(self._line, b"100 900 300\n")
                    elif text:
                        self.commands.append(text)
                        os.write(self._line, b"ok\n")

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        os.close(self._far)
        os.close(self._line)


class Terminal:
    """A `sceann` command in a terminal of its own.

    Attributes:
        process: the command.
        printed: what came out so far.
    """

    def __init__(self, *arguments: object) -> None:
        self._master, slave = pty.openpty()
        self.printed = ""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "sceann_hil.cli", *map(str, arguments)],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
            env={**os.environ, "TERM": "xterm", "COLUMNS": "120", "LINES": "30"},
        )
        os.close(slave)
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self) -> None:
        with contextlib.suppress(OSError):
            while data := os.read(self._master, 4096):
                self.printed += data.decode(errors="replace")

    @property
    def text(self) -> str:
        """What was printed, without colours and cursor movements."""
        return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", self.printed).replace("\r", "")

    def type(self, keys: str) -> None:
        """Press keys."""
        os.write(self._master, keys.encode())

    def close(self) -> None:
        """Close the window: the kernel hangs up."""
        os.close(self._master)
        self._master = -1

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        if self._master >= 0:
            os.close(self._master)


@contextmanager
def evolving(directory: Path, rover: Rover, operator: str = "none", *more: str) -> Iterator[Terminal]:
    """`sceann evolve` on the rover, in the middle of a trial."""
    (directory / "rover.yaml").write_text(CONFIG.format(port=rover.port))
    arguments = ("evolve", directory / "rover.yaml", "--out", directory / "run", "--record", "none")
    with Terminal(*arguments, "--operator", operator, *more) as terminal:
        if operator == "console":
            wait_for(lambda: "Put the robot" in terminal.text, terminal)
            time.sleep(0.5)
            terminal.type("r")
        wait_for(lambda: sum(command != "m 0 0" for command in rover.commands) > 3, terminal)
        yield terminal


def wait_for(happened: Callable[[], bool], terminal: Terminal, timeout_s: float = 60.0) -> None:
    """Wait until something is so."""
    deadline = time.monotonic() + timeout_s
    while not happened():
        assert time.monotonic() < deadline, f"waited in vain; the terminal said:\n{terminal.text[-1500:]}"
        time.sleep(0.02)

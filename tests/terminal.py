"""A command in a real (pseudo) terminal of 80 by 24, typed at as a person types."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]


class Terminal:
    """What a command shows, and a keyboard.

    Attributes:
        shown: everything that came so far.
        returncode: of the command; None while it runs.
    """

    def __init__(self, process: subprocess.Popen[bytes], descriptor: int) -> None:
        self._process = process
        self._fd = descriptor
        self._raw = b""

    @property
    def shown(self) -> str:
        return self._raw.decode(errors="replace")

    def type(self, keys: str | bytes) -> None:
        os.write(self._fd, keys.encode() if isinstance(keys, str) else keys)

    def until(self, text: str, patience_s: float = 60.0, *, after: int = 0) -> bool:
        """Wait for a text; whether it was shown in time, `after` so many characters."""
        deadline = time.monotonic() + patience_s
        while text not in self.shown[after:]:
            if time.monotonic() > deadline or not self._take(deadline - time.monotonic()):
                return text in self.shown[after:]
        return True

    def wait(self, patience_s: float = 60.0) -> int:
        """The command's exit code, once it has shown everything."""
        deadline = time.monotonic() + patience_s
        while self._take(deadline - time.monotonic()):
            pass
        return self._process.wait(max(1.0, deadline - time.monotonic()))

    def wait_briefly(self) -> int | None:
        """The exit code, if the command ends within half a second."""
        self._take(0.1)
        try:
            return self._process.wait(0.4)
        except subprocess.TimeoutExpired:
            return None

    def interrupt(self) -> None:
        self._process.send_signal(signal.SIGINT)

    def _take(self, patience_s: float) -> bool:
        if not select.select([self._fd], [], [], max(0.0, patience_s))[0]:
            return False
        try:
            chunk = os.read(self._fd, 65536)
        except OSError:
            return False
        self._raw += chunk
        return bool(chunk)


@contextmanager
def terminal(
    arguments: Sequence[str], cwd: Path, environment: Mapping[str, str] | None = None, lines: int = 24
) -> Iterator[Terminal]:
    """`sceann` with these arguments in a terminal of its own; killed if the block leaves it running."""
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", lines, 80, 0, 0))
    told = {"PYTHONPATH": str(REPOSITORY), "TERM": "xterm", "COLUMNS": "80", "LINES": str(lines), **(environment or {})}
    process = subprocess.Popen(
        [sys.executable, "-m", "sceann_hil.cli", *arguments],
        cwd=cwd,
        stdin=slave,
        stdout=slave,
        stderr=slave,
        start_new_session=True,
        env={**os.environ, **told},
    )
    os.close(slave)
    try:
        yield Terminal(process, master)
    finally:
        if process.poll() is None:
            process.kill()
        process.wait(20)
        os.close(master)

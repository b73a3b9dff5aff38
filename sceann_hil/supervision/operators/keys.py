"""Single keys from a terminal, or lines where there is none."""

from __future__ import annotations

import os
import select
import sys
import termios
import tty
from contextlib import suppress
from typing import Protocol

from sceann_hil.supervision.operators.verbs import Verb

KEYS: dict[str, Verb] = {
    "r": Verb.READY,
    "s": Verb.SKIP,
    "q": Verb.ABORT,
    " ": Verb.STOP,
    "g": Verb.GOAL,
    "a": Verb.ACCEPT,
    "d": Verb.REDO,
    "x": Verb.DISCARD,
    "n": Verb.NOTE,
    "p": Verb.PAUSE_AFTER,
    "h": Verb.PAUSE_NOW,
    "c": Verb.RESUME,
    "f": Verb.FINISH,
    "!": Verb.EMERGENCY_STOP,
    "b": Verb.BATTERY_SWAPPED,
}
"""A key of its own for every verb, so that a key that was meant for another question is never an answer to this one."""

KEY_NAMES = {verb: "space" if key == " " else key for key, verb in KEYS.items()}


class KeySource(Protocol):
    """Where keys come from."""

    def read(self, timeout_s: float) -> tuple[str, str] | None:
        """A key and the words that came with it in the same line; None after `timeout_s`.

        Raises:
            EOFError: there will be none any more.
        """

    def words(self) -> str | None:
        """A line of words; None if it was given up.

        Raises:
            EOFError: there will be none any more.
        """

    def drop(self) -> None:
        """Forget what was typed and not read."""

    def close(self) -> None:
        """Leave the terminal as it was found."""


class TerminalKeys:
    """Keys as they are hit, without Enter; also over ssh.

    Raises:
        OSError, termios.error: standard input is no terminal.
    """

    def __init__(self, descriptor: int | None = None) -> None:
        self._fd = sys.stdin.fileno() if descriptor is None else descriptor
        self._before = termios.tcgetattr(self._fd)
        tty.setcbreak(self._fd, termios.TCSANOW)

    def read(self, timeout_s: float) -> tuple[str, str] | None:
        ready, _, _ = select.select([self._fd], [], [], timeout_s)
        if not ready:
            return None
        byte = self._byte()
        return (byte, "") if byte != "\x04" else self._end()

    def words(self) -> str | None:
        typed = ""
        while True:
            byte = self._byte()
            if byte in "\r\n":
                return typed
            if byte == "\x1b":
                return None
            if byte == "\x04":
                self._end()
            typed = typed[:-1] if byte in "\x7f\b" else typed + byte
            echo = "\b \b" if byte in "\x7f\b" else byte
            os.write(self._fd, echo.encode())

    def _byte(self) -> str:
        try:
            byte = os.read(self._fd, 1)
        except OSError as error:
            raise EOFError from error
        if not byte:
            raise EOFError
        return byte.decode(errors="replace")

    @staticmethod
    def _end() -> tuple[str, str]:
        raise EOFError

    def drop(self) -> None:
        termios.tcflush(self._fd, termios.TCIFLUSH)

    def close(self) -> None:
        # the terminal may be gone
        with suppress(OSError, termios.error):
            termios.tcsetattr(self._fd, termios.TCSANOW, self._before)


class Lines:
    """A letter (or a verb's name) and Enter; the rest of the line are words."""

    def __init__(self, descriptor: int | None = None) -> None:
        self._fd = sys.stdin.fileno() if descriptor is None else descriptor
        self._buffer = b""

    def read(self, timeout_s: float) -> tuple[str, str] | None:
        line = self._line(timeout_s)
        if line is None:
            return None
        first, _, rest = line.strip().partition(" ")
        named = {verb.value: key for key, verb in KEYS.items()} | {"space": " "}
        return named.get(first, first), rest.strip()

    def words(self) -> str | None:
        while (line := self._line(1.0)) is None:
            pass
        return line.strip() or None

    def _line(self, timeout_s: float) -> str | None:
        if b"\n" not in self._buffer:
            ready, _, _ = select.select([self._fd], [], [], timeout_s)
            if not ready:
                return None
            chunk = os.read(self._fd, 4096)
            if not chunk:
                raise EOFError
            self._buffer += chunk
        if b"\n" not in self._buffer:
            return None
        line, _, self._buffer = self._buffer.partition(b"\n")
        return line.decode(errors="replace")

    def drop(self) -> None:
        self._buffer = b""
        while select.select([self._fd], [], [], 0)[0]:
            if not os.read(self._fd, 4096):
                raise EOFError

    def close(self) -> None:
        """There is nothing to put back."""


def open_keys() -> KeySource:
    """Single keys if standard input is a terminal that can give them, else lines."""
    try:
        return TerminalKeys()
    except (OSError, termios.error, ValueError):
        return Lines()

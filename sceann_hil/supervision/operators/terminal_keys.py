"""Single keys from a terminal of a POSIX system."""

from __future__ import annotations

import codecs
import os
import re
import select
import sys
import time
from contextlib import suppress

from sceann_hil.supervision.operators.hits import Hit, KeySource
from sceann_hil.supervision.operators.keymap import BACKSPACE, DELETE_LINE, ENTER, ESCAPE

# Windows has `windows_keys`
assert sys.platform != "win32"
import termios  # noqa: E402
import tty  # noqa: E402

_CONTROL = {"\r": ENTER, "\n": ENTER, "\x7f": BACKSPACE, "\b": BACKSPACE, "\x15": DELETE_LINE}
_FUNCTIONS = [f"F{number}" for number in range(1, 13)]
_SEQUENCES = {
    **dict(zip((f"[{code}~" for code in (11, 12, 13, 14, 15, 17, 18, 19, 20, 21, 23, 24)), _FUNCTIONS, strict=True)),
    **dict(zip(("OP", "OQ", "OR", "OS"), _FUNCTIONS, strict=False)),
    **dict(zip(("[[A", "[[B", "[[C", "[[D", "[[E"), _FUNCTIONS, strict=False)),
    **{"[A": "ArrowUp", "[B": "ArrowDown", "[C": "ArrowRight", "[D": "ArrowLeft"},
    **{"OA": "ArrowUp", "OB": "ArrowDown", "OC": "ArrowRight", "OD": "ArrowLeft"},
    **{"[5~": "PageUp", "[6~": "PageDown", "[2~": "Insert", "[3~": "Delete"},
    **{"[H": "Home", "[F": "End", "OH": "Home", "OF": "End", "[1~": "Home", "[4~": "End"},
}
"""What terminals send for keys without a character."""
_SEQUENCE = re.compile(r"\[\[.|\[[0-?]*[ -/]*[@-Z\\-~]|O.")
_END_OF_INPUT = "\x04"
_SEQUENCE_S = 0.05
"""A key's sequence arrives at once; an Escape that nothing follows is the key."""


class TerminalKeys:
    """Keys as they are hit, without Enter; also over ssh. Characters are UTF-8, however their bytes arrive.

    Raises:
        OSError, termios.error: standard input is no terminal.
    """

    def __init__(self, descriptor: int | None = None) -> None:
        self._fd = sys.stdin.fileno() if descriptor is None else descriptor
        self._before = termios.tcgetattr(self._fd)
        tty.setcbreak(self._fd, termios.TCSANOW)
        self._decoder = codecs.getincrementaldecoder("utf-8")("replace")
        self._typed = ""

    def read(self, timeout_s: float) -> Hit | None:
        until_s = time.monotonic() + timeout_s
        while not self._typed:
            if not self._fill(max(0.0, until_s - time.monotonic())):
                return None
        character, self._typed = self._typed[0], self._typed[1:]
        if character == _END_OF_INPUT:
            raise EOFError
        if character == "\x1b":
            return self._sequence()
        return Hit(_CONTROL.get(character, "Tab" if character == "\t" else character))

    def _sequence(self) -> Hit | None:
        """The key whose sequence has begun; None for one that has no name."""
        while True:
            if whole := _SEQUENCE.match(self._typed):
                self._typed = self._typed[whole.end() :]
                name = _SEQUENCES.get(whole.group())
                return Hit(name) if name else None
            if self._typed[:1] not in ("", "[", "O") or not self._fill(_SEQUENCE_S):
                return Hit(ESCAPE)

    def _fill(self, timeout_s: float) -> bool:
        """Whether bytes came; they may be a part of a character only."""
        if not select.select([self._fd], [], [], timeout_s)[0]:
            return False
        try:
            chunk = os.read(self._fd, 1024)
        except OSError as error:
            raise EOFError from error
        if not chunk:
            raise EOFError
        self._typed += self._decoder.decode(chunk)
        return True

    def drop(self) -> None:
        # a terminal that is gone is noticed by the next read
        with suppress(OSError, termios.error):
            termios.tcflush(self._fd, termios.TCIFLUSH)
        self._typed = ""
        self._decoder.reset()

    def close(self) -> None:
        # the terminal may be gone
        with suppress(OSError, termios.error):
            termios.tcsetattr(self._fd, termios.TCSANOW, self._before)


def open_keyboard(descriptor: int) -> KeySource | None:
    """Single keys, if it is a terminal that can give them."""
    try:
        return TerminalKeys(descriptor)
    except (OSError, termios.error):
        return None

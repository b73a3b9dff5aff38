"""Single keys from a console of Windows, and lines where there is none. It was never tried there."""

from __future__ import annotations

import os
import queue
import sys
import threading
import time

from sceann_hil.supervision.operators.hits import Hit, KeySource, LineBuffer
from sceann_hil.supervision.operators.keymap import BACKSPACE, DELETE_LINE, ENTER, ESCAPE

# other systems have `terminal_keys`
assert sys.platform == "win32"
import msvcrt  # noqa: E402

_CONTROL = {
    "\r": ENTER,
    "\n": ENTER,
    "\b": BACKSPACE,
    "\x7f": BACKSPACE,
    "\x15": DELETE_LINE,
    "\x1b": ESCAPE,
    "\t": "Tab",
}
_BEFORE_A_CODE = ("\x00", "\xe0")
_CODES = {
    **{chr(0x3B + number): f"F{number + 1}" for number in range(10)},
    **{"\x85": "F11", "\x86": "F12"},
    **{"H": "ArrowUp", "P": "ArrowDown", "K": "ArrowLeft", "M": "ArrowRight"},
    **{"I": "PageUp", "Q": "PageDown", "G": "Home", "O": "End", "R": "Insert", "S": "Delete"},
}
"""What the console says of a key without a character, after one of `_BEFORE_A_CODE`."""
_END_OF_INPUT = ("\x1a", "\x04")
_BETWEEN_LOOKS_S = 0.02


class WindowsKeys:
    """Keys as they are hit, without Enter."""

    def read(self, timeout_s: float) -> Hit | None:
        until_s = time.monotonic() + timeout_s
        while not msvcrt.kbhit():
            if time.monotonic() > until_s:
                return None
            time.sleep(_BETWEEN_LOOKS_S)
        character = msvcrt.getwch()
        if character in _BEFORE_A_CODE:
            name = _CODES.get(msvcrt.getwch())
            return Hit(name) if name else None
        if character in _END_OF_INPUT:
            raise EOFError
        return Hit(_CONTROL.get(character, character))

    def drop(self) -> None:
        while msvcrt.kbhit():
            msvcrt.getwch()

    def close(self) -> None:
        """There is nothing to put back."""


class WaitedForLines:
    """Lines from a pipe or a file, which nobody can ask there whether something has come: a thread waits for them."""

    def __init__(self, descriptor: int) -> None:
        self._buffer = LineBuffer()
        self._chunks: queue.Queue[bytes] = queue.Queue()
        threading.Thread(target=self._wait, args=(descriptor,), name="lines", daemon=True).start()

    def _wait(self, descriptor: int) -> None:
        chunk = b"-"
        while chunk:
            try:
                chunk = os.read(descriptor, 4096)
            except OSError:
                chunk = b""
            self._chunks.put(chunk)

    def read(self, timeout_s: float) -> Hit | None:
        if (hit := self._buffer.take()) is not None:
            return hit
        try:
            self._add(self._chunks.get(timeout=timeout_s))
        except queue.Empty:
            return None
        return self._buffer.take()

    def drop(self) -> None:
        self._buffer = LineBuffer()
        while not self._chunks.empty():
            self._add(self._chunks.get())
        self._buffer = LineBuffer()

    def _add(self, chunk: bytes) -> None:
        if not chunk:
            # the next one who asks is told, too
            self._chunks.put(chunk)
            raise EOFError
        self._buffer.add(chunk)

    def close(self) -> None:
        """There is nothing to put back."""


def open_keyboard(descriptor: int) -> KeySource | None:
    """Single keys of a console, lines of everything else."""
    return WindowsKeys() if os.isatty(descriptor) else WaitedForLines(descriptor)

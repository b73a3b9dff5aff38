"""Keys of whoever sits at this computer: single ones from a terminal, or lines where there is none."""

from __future__ import annotations

import os
import select
import sys

if sys.platform == "win32":
    from sceann_hil.supervision.operators.windows_keys import open_keyboard
else:
    from sceann_hil.supervision.operators.terminal_keys import open_keyboard

from sceann_hil.supervision.operators.hits import Hit, KeySource, LineBuffer


class Lines:
    """A letter (or a verb's name) and Enter; the rest of the line are words."""

    def __init__(self, descriptor: int | None = None) -> None:
        self._fd = sys.stdin.fileno() if descriptor is None else descriptor
        self._buffer = LineBuffer()

    def read(self, timeout_s: float) -> Hit | None:
        if (hit := self._buffer.take()) is not None:
            return hit
        if not select.select([self._fd], [], [], timeout_s)[0]:
            return None
        try:
            chunk = os.read(self._fd, 4096)
        except OSError as error:
            raise EOFError from error
        if not chunk:
            raise EOFError
        self._buffer.add(chunk)
        return self._buffer.take()

    def drop(self) -> None:
        self._buffer = LineBuffer()
        while select.select([self._fd], [], [], 0)[0]:
            try:
                if not os.read(self._fd, 4096):
                    raise EOFError
            except OSError as error:
                raise EOFError from error

    def close(self) -> None:
        """There is nothing to put back."""


class NoKeys:
    """There is no standard input at all: its end is there from the beginning."""

    def read(self, timeout_s: float) -> Hit | None:
        raise EOFError

    def drop(self) -> None:
        """There is nothing to forget."""

    def close(self) -> None:
        """There is nothing to put back."""


def open_keys() -> KeySource:
    """Single keys if standard input is a terminal that can give them, lines if it is something else."""
    try:
        # Python sets it to None when the program was started with a closed one
        descriptor = sys.stdin.fileno() if sys.stdin is not None else -1
        os.fstat(descriptor)
    except (OSError, ValueError):
        return NoKeys()
    return open_keyboard(descriptor) or Lines(descriptor)

"""Standard input, output and error as a command finds them: closed, without a reader, or of few characters.

A program that is started by another one inherits what that one left: a terminal that knows no UTF-8, a pipe whose
reader has gone (`sceann status RUN | head`), or nothing at all. None of that is a reason to end a run, or a bug.
"""

# ruff: noqa: RUF001 - a table of characters that look alike

from __future__ import annotations

import codecs
import errno
import io
import os
import select
import sys
import unicodedata
from contextlib import suppress
from typing import TextIO

PLAIN = "sceann_plain"
"""Error handler for characters that a terminal cannot show: the nearest that it can."""
_NEAREST = {
    **dict.fromkeys("‐‑‒–—―−", "-"),
    **dict.fromkeys("‘’‚‛′", "'"),
    **dict.fromkeys("“”„‟″", '"'),
    **dict.fromkeys("─━═╌╍┄┅┈┉╴╶╸╺", "-"),
    **dict.fromkeys("│┃║╎╏┆┇┊┋╵╷╹╻", "|"),
    **dict.fromkeys("█▓▒▇▆▅", "#"),
    **dict.fromkeys("▄▃▂▁▀░", "."),
    **dict.fromkeys("•‣∙●○◦", "*"),
    **{"…": "...", "→": "->", "←": "<-", "↑": "^", "↓": "v", "↔": "<->", "⇒": "=>"},
    **{"×": "x", "·": "*", "÷": "/", "±": "+-", "≤": "<=", "≥": ">=", "≠": "!=", "≈": "~", "∞": "inf", "√": "sqrt"},
    **{"°": " deg", "µ": "u", "μ": "u", "Δ": "d", "σ": "sigma", "ρ": "rho", "τ": "tau", "π": "pi", "½": "1/2"},
    **{"✓": "yes", "✔": "yes", "✗": "no", "✘": "no", "€": "EUR", "\u00a0": " ", "\u202f": " ", "\u2009": " "},
}
_WITHOUT_READER = (errno.EPIPE, errno.EIO, errno.EBADF, errno.ESHUTDOWN)


def prepare() -> None:
    """Make the three streams safe to use; once, before anything is read or written."""
    codecs.register_error(PLAIN, _plain)
    _fill_gaps()
    sys.stdin = sys.stdin if sys.stdin is not None else _reader(0)
    sys.stdout = _writer(1, sys.stdout)
    sys.stderr = _writer(2, sys.stderr)


def _plain(error: UnicodeError) -> tuple[bytes, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return b"".join(_near(character, error.encoding) for character in error.object[error.start : error.end]), error.end


def _near(character: str, encoding: str) -> bytes:
    if "\udc80" <= character <= "\udcff":
        # a byte of a file's name that is no UTF-8: whoever copies the name gets the byte
        return bytes([ord(character) - 0xDC00])
    if character in _NEAREST:
        return _NEAREST[character].encode()
    if "\u2500" <= character <= "\u257f":
        return b"+"
    without_accents = "".join(
        part for part in unicodedata.normalize("NFKD", character) if not unicodedata.combining(part)
    )
    try:
        return without_accents.encode(encoding) or b"?"
    except UnicodeEncodeError:
        return b"?"


class _Discarding(io.FileIO):
    """Writes to a descriptor until nobody reads there any more, and then nowhere."""

    def __init__(self, descriptor: int) -> None:
        super().__init__(descriptor, "wb", closefd=False)
        self._gone = False

    def write(self, data: object, /) -> int:
        length = memoryview(data).nbytes  # type: ignore[arg-type]
        if self._gone:
            return length
        try:
            while (written := super().write(data)) is None:  # type: ignore[arg-type]
                # whoever started us left the descriptor in a mode in which it does not wait
                select.select([], [self], [], 1.0)
            return written
        except OSError as error:
            if error.errno not in _WITHOUT_READER:
                raise
            self._gone = True
            return length


def _writer(descriptor: int, before: TextIO | None) -> TextIO:
    if before is not None:
        with suppress(OSError):
            before.flush()
    encoding = getattr(before, "encoding", None) or "utf-8"
    raw = _Discarding(descriptor)
    at_once = descriptor == 2 or raw.isatty()
    return io.TextIOWrapper(io.BufferedWriter(raw), encoding, PLAIN, line_buffering=at_once, write_through=False)


def _reader(descriptor: int) -> TextIO:
    return io.TextIOWrapper(io.BufferedReader(io.FileIO(descriptor, "rb", closefd=False)), "utf-8", "replace")


def _fill_gaps() -> None:
    """The next file that is opened would get a closed one's number, and a journal must not be anybody's output."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            opened = os.open(os.devnull, os.O_RDWR)
            if opened != descriptor:
                os.dup2(opened, descriptor)
                os.close(opened)

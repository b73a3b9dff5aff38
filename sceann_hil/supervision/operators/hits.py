"""What somebody hit at a terminal, and where hits come from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from sceann_hil.supervision.operators.keymap import KEYS


@dataclass(frozen=True, slots=True)
class Hit:
    """What somebody hit.

    Attributes:
        key: a character, or the name of a key.
        words: what came with it in the same line; empty for single keys.
        line: the whole line, where lines are all that there is; None for single keys.
    """

    key: str
    words: str = ""
    line: str | None = None


class KeySource(Protocol):
    """Where keys come from."""

    def read(self, timeout_s: float) -> Hit | None:
        """The next one; None after `timeout_s`.

        Raises:
            EOFError: there will be none any more.
        """

    def drop(self) -> None:
        """Forget what was typed and not read."""

    def close(self) -> None:
        """Leave the terminal as it was found."""


class LineBuffer:
    """Bytes that come, and the whole lines among them: a letter (or a verb's name), and words."""

    def __init__(self) -> None:
        self._buffer = b""

    def add(self, chunk: bytes) -> None:
        """What has come."""
        self._buffer += chunk

    def take(self) -> Hit | None:
        """The next whole line; None if there is none."""
        if b"\n" not in self._buffer:
            return None
        raw, _, self._buffer = self._buffer.partition(b"\n")
        line = raw.decode(errors="replace").strip()
        first, _, rest = line.partition(" ")
        named = {verb.value: key for key, verb in KEYS.items()} | {"space": " "}
        return Hit(named.get(first, first), rest.strip(), line)

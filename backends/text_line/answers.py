"""An answer in plain text, told by its pattern: ``"l={} r={}"`` reads two numbers."""

from __future__ import annotations

import re

_NUMBER = r"([-+]?\d+(?:\.\d+)?)"
_PLACE = "{}"


class Pattern:
    """What a line must look like, with ``{}`` where a number stands.

    White space stands for any amount of it; everything else must be there letter by letter.

    Args:
        text: the pattern; a pattern without ``{}`` is a fixed answer, such as ``ok``.

    Raises:
        ValueError: nothing but numbers without anything between them, which nobody can tell apart.
    """

    def __init__(self, text: str) -> None:
        if "{}{}" in text:
            raise ValueError(f"answer: expected something between two numbers, got {text!r}")
        self.text = text
        self.n_numbers = text.count(_PLACE)
        words = [_NUMBER.join(map(re.escape, word.split(_PLACE))) for word in text.split()]
        self._expression = re.compile(r"\s*" + r"\s+".join(words) + r"\s*")

    def read(self, line: str) -> tuple[float, ...]:
        """The numbers in a line, in their order.

        Raises:
            ValueError: the line does not look like that.
        """
        match = self._expression.fullmatch(line)
        if match is None:
            raise ValueError(f"expected an answer like {self.text!r}, got {line!r}")
        return tuple(map(float, match.groups()))

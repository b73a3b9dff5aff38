"""The text of an AESL program as words, numbers and signs."""

from __future__ import annotations

import re
from collections.abc import Sequence

KEYWORDS = frozenset(
    (
        *("abs", "and", "call", "callsub", "const", "do", "else", "elseif", "emit", "end", "for", "if", "in", "not"),
        *("onevent", "or", "return", "step", "sub", "then", "times", "var", "when", "while"),
    )
)
_WORD = re.compile(
    r"(?P<skip>\s+|#[^\n]*)|(?P<word>[A-Za-z_][A-Za-z0-9_.]*|\d+|<<|>>|[<>=!]=|\+=|[-+*/%&|^~<>=()\[\],:])"
)


class AeslError(ValueError):
    """A program that is none; the message says in which line and why."""


class Words:
    """The words of a program, read from first to last.

    Raises:
        AeslError: a sign that the language does not have.
    """

    def __init__(self, text: str) -> None:
        self._words: list[tuple[str, int]] = []
        self._next = 0
        at, line = 0, 1
        while at < len(text):
            match = _WORD.match(text, at)
            if match is None:
                raise AeslError(f"line {line}: expected a word of AESL, got {text[at]!r}")
            if match["word"]:
                self._words.append((match["word"], line))
            line += match[0].count("\n")
            at = match.end()

    @property
    def next(self) -> str:
        """The word that is to be read; empty at the end."""
        return self._words[self._next][0] if self._next < len(self._words) else ""

    def wrong(self, message: str) -> AeslError:
        """An error about the next word."""
        line = self._words[min(self._next, len(self._words) - 1)][1] if self._words else 1
        return AeslError(f"line {line}: {message}, got {self.next or 'the end'!r}")

    def take(self) -> str:
        """Read it."""
        word = self.next
        self._next += 1
        return word

    def took(self, *wanted: str) -> str:
        """Read it if it is one of these; else nothing."""
        return self.take() if self.next in wanted else ""

    def expect(self, wanted: str) -> None:
        """Read it.

        Raises:
            AeslError: it is another one.
        """
        if self.next != wanted:
            raise self.wrong(f"expected {wanted!r}")
        self.take()

    def name(self, known: Sequence[str] = ()) -> str:
        """Read a name.

        Raises:
            AeslError: it is none, or not one of `known`.
        """
        word = self.next
        if not (word[:1].isalpha() or word[:1] == "_") or word in KEYWORDS:
            raise self.wrong("expected a name")
        if known and word not in known:
            raise self.wrong("expected a name that is known here")
        return self.take()

    def number(self) -> int:
        """Read a number, perhaps with a sign.

        Raises:
            AeslError: it is none.
        """
        sign = -1 if self.took("-") else 1
        if not self.next.isdecimal():
            raise self.wrong("expected a number")
        return sign * int(self.take())

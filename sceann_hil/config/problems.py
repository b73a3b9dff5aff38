"""One thing that is wrong in a configuration, where it stands, and all of them as one message."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from difflib import get_close_matches
from typing import NoReturn

from sceann_hil.errors import ConfigError

Path = tuple[str | int, ...]
"""Where a value lives in the configuration: keys and list indices from the top."""

MOST_SHOWN = 10
"""Problems shown at once: more would not fit on one screen."""
HINT = "Nothing was started. `sceann schema` lists every key and its values."


@dataclass(frozen=True, slots=True, order=True)
class Place:
    """Where a value was written.

    Attributes:
        override: position of the ``--set`` option that wrote it, from 1; 0 for the file.
        line: line in the file, from 1; 0 if it was not written in a file.
        column: column in that line, from 1; 0 if it was not written in a file.
        source: the file, or the whole ``--set`` option.
    """

    override: int
    line: int
    column: int
    source: str

    @property
    def short(self) -> str:
        """Without the file's name, which the reader knows from the message's beginning."""
        return self.source if self.override or not self.line else f"line {self.line}"

    def __str__(self) -> str:
        return self.source if self.override or not self.line else f"{self.source}:{self.line}:{self.column}"


@dataclass(frozen=True, slots=True, order=True)
class Problem:
    """One thing that is wrong.

    Attributes:
        place: where it was written.
        key: the dotted key; empty if the whole file is at fault.
        message: what was expected, what was found, what is near.
    """

    place: Place
    key: str
    message: str

    def __str__(self) -> str:
        named = not self.key or self.place.source.startswith(f"--set {self.key}=")
        return f"{self.place}: {self.message}" if named else f"{self.place}: {self.key}: {self.message}"


class ConfigProblems(ConfigError):
    """A `ConfigError` that still knows the single problems, so that those of several configurations can be joined.

    Attributes:
        problems: sorted by place, each one once.
    """

    def __init__(self, message: str, problems: tuple[Problem, ...]) -> None:
        super().__init__(message, HINT)
        self.problems = problems


def raise_if_any(problems: Iterable[Problem]) -> None:
    """Report problems, sorted by place, each one once.

    Raises:
        ConfigProblems: there is at least one.
    """
    found = tuple(sorted(set(problems)))
    lines = [str(problem) for problem in found]
    if not lines:
        return
    if len(lines) > 1:
        first = [f"  {line}" for line in lines[:MOST_SHOWN]]
        if len(lines) > MOST_SHOWN:
            first.append(f"  ... and {len(lines) - MOST_SHOWN} more")
        lines = [f"{len(lines)} problems in the configuration:", *first]
    raise ConfigProblems("\n".join(lines), found)


def fail(place: Place, message: str) -> NoReturn:
    """Report the one problem that makes reading on pointless.

    Raises:
        ConfigError: always.
    """
    raise ConfigError(str(Problem(place, "", message)), HINT)


def dotted(path: Path) -> str:
    """A path as people write it: ``task.start_m[0]``."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def nearest(word: str, words: Iterable[str]) -> str | None:
    """The word that was probably meant, whatever the case of its letters."""
    by_lower = {candidate.lower(): candidate for candidate in words}
    found = get_close_matches(word.lower(), by_lower, n=1)
    return by_lower[found[0]] if found else None


def shown(value: object) -> str:
    """A value as it is named in a message, never longer than a line."""
    match value:
        case None:
            return "nothing"
        case bool():
            return "true" if value else "false"
        case int() | float():
            return _clipped(str(value))
        case str():
            return f"the text {_clipped(repr(value))}"
        case list():
            return f"a list of {len(value)} value{'s' * (len(value) != 1)}"
        case _:
            return "a section"


def any_of(words: Iterable[str]) -> str:
    """Alternatives in a sentence: ``a, b or c``."""
    *most, last = words
    return f"{', '.join(most)} or {last}" if most else last


def _clipped(text: str, most: int = 50) -> str:
    return text if len(text) <= most else f"{text[: most - 20]}...{text[-15:]}"

"""What a look at a robot finds, one thing at a time, each with advice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """How a check went."""

    GOOD = "ok"
    BAD = "bad"
    NOT_DONE = "not done"


@dataclass(frozen=True, slots=True)
class Finding:
    """One check.

    Attributes:
        check: what was looked at, in a few words.
        verdict: how it went.
        detail: what was seen, with numbers; may have several lines.
        advice: what to do about it; empty if nothing.
    """

    check: str
    verdict: Verdict
    detail: str
    advice: str = ""


Movement = Callable[[], Finding]
"""Moves the robot for a moment, and tells what was seen. Motors are at their safe output when it returns."""

Mover = Callable[[str, Movement], Finding]
"""Lets a robot do a movement, which it is told the name of, under the rules that hold for trials; what was found."""

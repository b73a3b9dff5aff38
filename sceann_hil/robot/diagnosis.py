"""What a look at a robot finds, one thing at a time, each with advice."""

from __future__ import annotations

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

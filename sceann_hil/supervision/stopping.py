"""Why a run ends before its last generation: in good order, with everything that was measured in the journal."""

from __future__ import annotations

from enum import Enum, auto


class StopReason(Enum):
    """Who wanted it."""

    ASKED = auto()
    """The command line (Ctrl-C)."""
    OPERATOR = auto()
    """The person beside the robot."""
    BUDGET = auto()
    """A budget is spent, or does not suffice for one more trial."""


class Stopped(Exception):
    """The run was asked to end; it can be resumed.

    Attributes:
        reason: who wanted it.
        message: what to tell a person.
    """

    def __init__(self, reason: StopReason = StopReason.ASKED, message: str = "before a trial, as asked") -> None:
        super().__init__(message)
        self.reason = reason
        self.message = message

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
    """A budget is spent, or what is left of it is less than one more trial takes."""
    TERMINATED = auto()
    """The system or another program (SIGTERM)."""
    HUNG_UP = auto()
    """The terminal was closed (SIGHUP)."""


class Stopped(Exception):
    """The run was asked to end; it can be resumed.

    Attributes:
        reason: who wanted it.
        message: what to tell a person: a whole sentence without its full stop.
    """

    def __init__(
        self, reason: StopReason = StopReason.ASKED, message: str = "Stopped before the next trial, as you asked"
    ) -> None:
        super().__init__(message)
        self.reason = reason
        self.message = message


class StopRequest(Enum):
    """What somebody outside the desk wants of a running session."""

    NONE = auto()
    AFTER_GENERATION = auto()
    NOW = auto()
    TERMINATED = auto()
    HUNG_UP = auto()

    @property
    def at_once(self) -> Stopped | None:
        """What ends the session before its next trial; None if nothing does."""
        return {
            StopRequest.NOW: Stopped(),
            StopRequest.TERMINATED: Stopped(StopReason.TERMINATED, "Stopped by the system (SIGTERM)"),
            StopRequest.HUNG_UP: Stopped(StopReason.HUNG_UP, "Stopped because the terminal was closed (SIGHUP)"),
        }.get(self)


def nobody() -> StopRequest:
    """Nobody wants anything."""
    return StopRequest.NONE

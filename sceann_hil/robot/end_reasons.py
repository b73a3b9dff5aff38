"""Why a trial ended, and what a robot raises when it cannot run one."""

from __future__ import annotations

from enum import IntEnum


class EndReason(IntEnum):
    """Why a trial ended. The numbers are stored in journals and sent over the link; they never change.

    Task ends are results. Void ends say that nothing was measured: no fitness is ever made of them.
    """

    TIME_UP = 0
    GOAL = 1
    FELL = 2
    OUT_OF_BOUNDS = 3
    LINK_LOST = 16
    BATTERY = 17
    OPERATOR = 18
    FAULT = 19
    EMERGENCY_STOP = 20
    OVERRUN = 21

    def __str__(self) -> str:
        return self.name.lower().replace("_", " ")

    @property
    def is_void(self) -> bool:
        """True if the trial measured nothing and must never reach selection."""
        return self >= EndReason.LINK_LOST


class RobotError(Exception):
    """Something about the robot; the subclasses say what happens next."""


class LinkError(RobotError):
    """The robot cannot be reached: retry, then pause the run."""


class TrialVoid(RobotError):
    """This attempt measured nothing: attempt the trial again within the retry limit."""


class RobotFault(RobotError):
    """The robot is not as it should be: halt, a person must look."""


class EmergencyStop(RobotError):
    """Somebody pressed stop: halt."""

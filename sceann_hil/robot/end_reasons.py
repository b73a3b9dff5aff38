"""Why a trial ended, and what a robot raises when it cannot run one."""

from __future__ import annotations

from enum import IntEnum

from sceann_hil.errors import RobotIsFaulty, RobotUnreachable, RobotWasStopped, ToldAs, TrialsKeepFailing


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


class RobotError(ToldAs):
    """Something about the robot; the subclasses say what happens next."""


class LinkError(RobotError):
    """The robot cannot be reached: retry, then pause the run."""

    user_error = RobotUnreachable
    advice = "Check power, cable and port, then try again; `sceann resume` goes on with a run that has begun."


class TrialVoid(RobotError):
    """This attempt measured nothing: attempt the trial again within the retry limit."""

    user_error = TrialsKeepFailing
    advice = "Find out why the trials fail, then `sceann resume` the run."


class RobotFault(RobotError):
    """The robot is not as it should be: halt, a person must look."""

    user_error = RobotIsFaulty
    advice = "Look at the robot before you `sceann resume` the run."


class EmergencyStop(RobotError):
    """Somebody pressed stop: halt."""

    user_error = RobotWasStopped
    advice = "Make sure that it is safe, then `sceann resume` the run."

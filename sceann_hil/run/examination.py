"""The doctor's movements, under the rules that hold for trials: suspenders before them, and anybody may stop them."""

from __future__ import annotations

import tempfile
from collections.abc import Generator
from pathlib import Path

from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.robot import Robot, RobotError
from sceann_hil.robot.diagnosis import Finding, Verdict
from sceann_hil.supervision.operators import Desk, Situation
from sceann_hil.supervision.suspension import Suspension

_SITUATION = Situation(0, 0, 0, 0, "", heading="examination by the doctor")


def examined(robot: Robot, config: ExperimentConfig, desk: Desk, *, may_move: bool) -> Generator[Finding, None, None]:
    """All findings; the motors are not tried while a suspender of the configuration would pause a run.

    Args:
        robot: not connected.
        config: whose suspenders hold.
        desk: where a stop comes from.
        may_move: somebody has seen to it that the robot may move for a moment.
    """
    if may_move and config.suspenders.build():
        found = _suspended(robot, config, desk)
        if found is not None:
            yield found
            may_move = may_move and found.verdict is Verdict.GOOD
    with desk.flight(_SITUATION, robot.interrupt) as flight:
        for finding in robot.diagnose(may_move=may_move):
            yield finding
            if flight.void_reason is not None:
                return


def _suspended(robot: Robot, config: ExperimentConfig, desk: Desk) -> Finding | None:
    """What the suspenders say; None if the robot cannot be asked, which the examination finds out anyway."""
    suspension = Suspension(config.suspenders.build(), robot, desk, Path(tempfile.gettempdir()))
    try:
        with robot:
            suspension.check()
            reasons = [suspender.reason for suspender in suspension.reasons]
    except ConfigError as error:
        return Finding("suspenders", Verdict.BAD, error.message, error.hint)
    except RobotError:
        return None
    if reasons:
        told = f"a run would be suspended now ({', '.join(reasons)}), so the motors are not tried"
        return Finding("suspenders", Verdict.BAD, told, "Put that right first.")
    return Finding("suspenders", Verdict.GOOD, "none would pause a run now")

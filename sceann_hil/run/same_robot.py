"""Whether a run goes on with the robot that it began with: trials that tell of one robot tell nothing of another."""

from __future__ import annotations

from sceann_hil.errors import ConfigError
from sceann_hil.journal import Journal
from sceann_hil.robot import Robot
from sceann_hil.supervision.operators import Desk, Phase, Situation, Verb

_KIND = "robot"
"""Of the journal's events whose message is the robot's identity."""


def check_same_robot(journal: Journal, robot: Robot, desk: Desk) -> None:
    """Note which robot this is; if it is another one than before, ask the person beside it.

    Args:
        journal: of the run.
        robot: connected; one that does not know who it is, is believed.
        desk: where the operators are.

    Raises:
        ConfigError: it is another robot, and nobody is there to ask.
        Stopped: the person ends the run.
    """
    now = robot.identity
    if now is None:
        return
    known = [message for _, _, kind, message in journal.reader.events() if kind == _KIND]
    if known and known[-1] != now:
        told = f"This is another robot (id {now}) than the one that did this run's trials (id {known[-1]})."
        if not (desk.asks and robot.spec.attended):
            raise ConfigError(
                told,
                "Connect that one. If this one is meant to go on for it, resume with a person to ask: "
                "--operator console. Nothing was lost.",
            )
        situation = Situation(0, 0, 0, 0, f"{told} Go on only if its trials may count as the other one's.", (), False)
        while desk.ask(Phase.BEFORE, situation).verb is Verb.SKIP:
            pass
    if not known or known[-1] != now:
        journal.note(_KIND, now)

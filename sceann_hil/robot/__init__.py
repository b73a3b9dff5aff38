"""The abstract Robot: run these trials and tell what happened.

A simulated robot runs a whole batch in one compiled call; a physical one runs trials one by one. The evaluator never
asks which it has: it reads the robot's `RobotSpec`.

* `abstract`: `Robot`, what every backend implements.
* `facts`: what a robot is and how it is.
* `trials`: what it is asked, and what it answers.
* `end_reasons`: why a trial ended, and the errors that a robot raises.
"""

from sceann_hil.robot.abstract import UNKNOWN_STATE, Robot, TrialObserver
from sceann_hil.robot.end_reasons import EmergencyStop, EndReason, LinkError, RobotError, RobotFault, TrialVoid
from sceann_hil.robot.facts import NOT_IDENTIFIABLE, Estimated, GapEstimate, Health, RobotSpec
from sceann_hil.robot.trials import Results, Trace, Trials

__all__ = [
    "NOT_IDENTIFIABLE",
    "UNKNOWN_STATE",
    "EmergencyStop",
    "EndReason",
    "Estimated",
    "GapEstimate",
    "Health",
    "LinkError",
    "Results",
    "Robot",
    "RobotError",
    "RobotFault",
    "RobotSpec",
    "Trace",
    "TrialObserver",
    "TrialVoid",
    "Trials",
]

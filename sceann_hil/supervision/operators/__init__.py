"""Who stands beside the robot: nobody, a person at the console or with a phone, or a script.

`verbs` is what can be said and when, `Desk` is where run and operators meet, and `Console`, `Script` and the web panel
(`sceann_hil.supervision.operators.web`) are the operators. `OperatorConfig` is the configuration's section.
"""

from sceann_hil.supervision.operators.desk import Desk, Flight
from sceann_hil.supervision.operators.messages import Finished, Press, Receipt, Situation, Status, View
from sceann_hil.supervision.operators.operator import Operator
from sceann_hil.supervision.operators.settings import OperatorConfig, Prompt, Who
from sceann_hil.supervision.operators.verbs import ACCEPTED, Phase, Verb

__all__ = [
    "ACCEPTED",
    "Desk",
    "Finished",
    "Flight",
    "Operator",
    "OperatorConfig",
    "Phase",
    "Press",
    "Prompt",
    "Receipt",
    "Situation",
    "Status",
    "Verb",
    "View",
    "Who",
]

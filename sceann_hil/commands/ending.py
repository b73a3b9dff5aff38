"""How a command leaves that somebody ended: one exit code for each who can want it."""

from __future__ import annotations

from sceann_hil.errors import ExitCode
from sceann_hil.supervision.stopping import StopReason

EXIT_CODES = {
    StopReason.ASKED: ExitCode.INTERRUPTED_NOW,
    StopReason.OPERATOR: ExitCode.OPERATOR_FINISHED,
    StopReason.BUDGET: ExitCode.BUDGET_SPENT,
    StopReason.TERMINATED: ExitCode.TERMINATED,
    StopReason.HUNG_UP: ExitCode.HUNG_UP,
}

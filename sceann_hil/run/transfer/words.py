"""What people are told before a trial: which controller, why, and what is expected."""

from __future__ import annotations

from sceann_hil.network.coding import genome_to_hex
from sceann_hil.run.transfer.state import Outlook, TransferState, Verdict

VERDICTS = {
    Verdict.TRIALS_DONE: "as many trials were done as were wanted",
    Verdict.ENOUGH: "it is enough, one more trial would bring next to nothing",
    Verdict.TARGET: "the wanted fitness is expected with great certainty",
    Verdict.NONE_SUCCEEDS: "no candidate is expected to succeed on this robot",
}


def expected(outlook: Outlook) -> str:
    """Expected fitness with its interval, in words."""
    low, high = outlook.interval
    return f"{outlook.fitness:.3g} ({low:.3g} to {high:.3g})"


def remark(state: TransferState) -> str:
    """Which controller is next, why, and how things stand."""
    genome = genome_to_hex(state.candidates[state.candidate])
    outlook = state.outlook
    if state.start is None:
        return (
            f"Recommended controller {genome}, measured on fresh trials: {VERDICTS.get(state.verdict, '')}. "
            f"Expected fitness {expected(outlook)}."
        )
    tried = int((state.observed.candidate == state.candidate).sum())
    if state.candidate == state.recommended:
        why = "the best so far, to be surer of it"
    elif tried:
        why = f"tried {tried} times, it may be the best"
    else:
        why = "not tried yet, it may be better than the best so far"
    hopeless = outlook.most_success is not None and outlook.most_success < 0.5
    doubt = " No candidate is expected to succeed in half of its trials." if hopeless else ""
    return (
        f"Trial {len(state.observed) + 1}: controller {genome}, {why}. Best so far: expected fitness "
        f"{expected(outlook)}; one more trial is expected to bring {outlook.gain:.2g}.{doubt}"
    )

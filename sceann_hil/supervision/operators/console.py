"""The operator at the terminal that the run was started from: single keys, also over ssh."""

from __future__ import annotations

import time
from collections.abc import Callable

from sceann_hil.supervision.operators.desk import Desk
from sceann_hil.supervision.operators.keys import KEY_NAMES, KEYS, KeySource
from sceann_hil.supervision.operators.messages import View
from sceann_hil.supervision.operators.operator import Operator
from sceann_hil.supervision.operators.verbs import Phase, Verb

QUIET_S = 0.25
"""Keys hit sooner after a question was shown were not meant for it: they are dropped."""
_AT_ONCE = frozenset({Verb.STOP, Verb.PAUSE_NOW, Verb.EMERGENCY_STOP})
"""Never dropped: stopping too often is better than once too late."""
_SHOWN = (Phase.BEFORE, Phase.AFTER, Phase.PAUSED, Phase.SUSPENDED, Phase.RUNNING)


class Console(Operator):
    """Shows every change as a line and reads keys.

    Args:
        desk: where to press.
        keys: where keys come from; closed at the end.
        show: prints a line.
    """

    name = "console"

    def __init__(self, desk: Desk, keys: KeySource, show: Callable[[str], object]) -> None:
        super().__init__(desk)
        self._keys = keys
        self._show = show

    def _serve(self) -> None:
        try:
            self._read_keys()
        except EOFError:
            self._show("End of input: the run ends in good order.")
            self.end_safely("end of input at the console")

    def stop(self) -> None:
        super().stop()
        self._keys.close()

    def _read_keys(self) -> None:
        shown = (Phase.IDLE, 0, "")
        shown_s = 0.0
        while not self._leaving.is_set():
            view = self.desk.view()
            if view.phase is Phase.CLOSED:
                return
            if (view.phase, view.question, view.reason) != shown:
                asks = view.phase in (Phase.BEFORE, Phase.AFTER)
                shown = (view.phase, view.question, view.reason)
                if asks:
                    self._keys.drop()
                if view.phase in _SHOWN:
                    self._show(describe(view))
                shown_s = time.monotonic()
            hit = self._keys.read(0.05)
            if hit is not None:
                self.desk.seen()
                self._take(hit[0], hit[1], view, quiet=time.monotonic() - shown_s < QUIET_S)

    def _take(self, key: str, words: str, view: View, *, quiet: bool) -> None:
        verb = KEYS.get(key)
        if verb is None:
            if key.strip():
                self._show(f"{key!r} means nothing here. {choices(view)}")
            return
        if quiet and verb not in _AT_ONCE:
            return
        if verb.wants_text and verb in view.accepts and not words:
            self._show(
                "Why? (Enter ends, Esc gives up)" if verb is Verb.DISCARD else "Note (Enter ends, Esc gives up):"
            )
            words = self._keys.words() or ""
        question = view.question if verb.is_answer else None
        receipt = self.desk.press(verb, by=self.name, question=question, text=words)
        self._show(receipt.message if receipt.accepted else f"{receipt.message}. {choices(self.desk.view())}")


def choices(view: View) -> str:
    """The keys that mean something now."""
    verbs = [verb for verb in Verb if verb in view.accepts]
    return "  ".join(f"[{KEY_NAMES[verb]}] {verb.words}" for verb in verbs)


def describe(view: View) -> str:
    """The view as text."""
    situation = view.situation
    lines = []
    if view.phase in (Phase.PAUSED, Phase.SUSPENDED):
        lines.append(f"Paused: {view.reason}.")
    elif situation is not None and view.phase is Phase.BEFORE:
        lines += [f"Next: {situation.title}.", situation.instruction]
    elif situation is not None and view.phase is Phase.AFTER:
        lines.append(f"Ended: {situation.title}: {situation.outcome}.")
    elif situation is not None and view.phase is Phase.RUNNING:
        lines.append(f"Running: {situation.title}.")
    lines += [f"! {warning}" for warning in view.status.warnings]
    lines.append(choices(view))
    return "\n".join(lines)

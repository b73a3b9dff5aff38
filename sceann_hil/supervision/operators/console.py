"""The operator at the terminal that the run was started from: single keys, also over ssh."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field

from sceann_hil.robot.drawing import Drawing
from sceann_hil.supervision.operators.desk import Desk
from sceann_hil.supervision.operators.draft import Draft
from sceann_hil.supervision.operators.hits import Hit, KeySource
from sceann_hil.supervision.operators.keymap import KEY_NAMES, STOP_KEYS, KeyMap
from sceann_hil.supervision.operators.messages import View
from sceann_hil.supervision.operators.operator import Operator
from sceann_hil.supervision.operators.sketch import sketch
from sceann_hil.supervision.operators.verbs import SCORES, Phase, Verb

QUIET_S = 0.25
"""Keys hit sooner after a question was shown were not meant for it: they are dropped."""
LOOK_S = 0.05
_AT_ONCE = frozenset({Verb.STOP, Verb.PAUSE_NOW, Verb.EMERGENCY_STOP})
"""Never dropped: stopping too often is better than once too late."""
_SHOWN = (Phase.BEFORE, Phase.AFTER, Phase.PAUSED, Phase.SUSPENDED, Phase.RUNNING)
_HELP = "?"


@dataclass
class _Asked:
    """Words that are being typed, and what they are for."""

    verb: Verb
    question: int | None
    draft: Draft = field(default_factory=Draft)


class Console(Operator):
    """Shows every change as a line and reads keys.

    Args:
        desk: where to press.
        keys: where keys come from; closed at the end.
        show: prints a line. Where nobody reads any more, the run goes on without.
        keymap: what the keys say.
        help_text: shown with the keys when somebody asks for help, such as the panel's link.
        drawing: of the robot; help before a trial draws where it has to stand.
    """

    name = "console"

    def __init__(
        self,
        desk: Desk,
        keys: KeySource,
        show: Callable[[str], object],
        keymap: KeyMap | None = None,
        help_text: Callable[[], str] = str,
        drawing: Drawing | None = None,
    ) -> None:
        super().__init__(desk)
        self._keys = keys
        self._print = show
        self._keymap = keymap or KeyMap()
        self._help_text = help_text
        self._drawing = drawing
        self._asked: _Asked | None = None

    def _show(self, text: str) -> None:
        with suppress(OSError, ValueError):
            self._print(text)

    def _serve(self) -> None:
        try:
            self._read_keys()
        except EOFError:
            self._show("End of input: the run ends in good order.")
            self.end_safely("end of input at the console")
        finally:
            self.desk.typing = ""

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
                if asks and self._asked is None:
                    self._keys.drop()
                if view.phase in _SHOWN:
                    self._show(self._describe(view))
                if asks or view.phase in (Phase.PAUSED, Phase.SUSPENDED):
                    # simulated trials that go by in milliseconds ask nothing and must not make anybody wait
                    shown_s = time.monotonic()
            hit = self._keys.read(LOOK_S)
            if hit is not None:
                self.desk.seen()
                if self._asked is not None and hit.key not in STOP_KEYS:
                    self._write(self._asked, hit)
                else:
                    self._take(hit, view, quiet=time.monotonic() - shown_s < QUIET_S)

    def _take(self, hit: Hit, view: View, *, quiet: bool) -> None:
        if _is_scored(view) and hit.key in SCORES:
            hit = Hit(KEY_NAMES[Verb.ACCEPT], hit.key)
        verb = self._keymap.verb(hit.key, view.accepts)
        if hit.key == _HELP and verb is None:
            before = view.situation if view.phase is Phase.BEFORE else None
            picture = sketch(self._drawing, dict(before.start)) if before is not None else ""
            self._show("\n".join(filter(None, (self._help_text(), picture, self._describe(view)))))
            return
        if verb is None:
            if hit.key.strip():
                self._show(f"{hit.key!r} means nothing here. {self._choices(view)}")
            return
        if quiet and verb not in _AT_ONCE:
            return
        question = view.question if verb.is_answer else None
        if verb.wants_text and verb in view.accepts and not hit.words:
            self._asked = _Asked(verb, question)
            if hit.line is not None:
                self._show("Why? (a line)" if verb is Verb.DISCARD else "Note (a line):")
            self._show_draft(self._asked)
            return
        self._say(verb, question, hit.words)

    def _write(self, asked: _Asked, hit: Hit) -> None:
        """One more key of the words."""
        asked.draft.take(hit)
        if not asked.draft.done:
            self._show_draft(asked)
            return
        self._asked = None
        self.desk.typing = ""
        self._say(asked.verb, asked.question, "" if asked.draft.given_up else asked.draft.text)

    def _show_draft(self, asked: _Asked) -> None:
        what = "Why" if asked.verb is Verb.DISCARD else "Note"
        self.desk.typing = f"{what} (Enter ends, Esc gives up): {asked.draft.text}"

    def _say(self, verb: Verb, question: int | None, words: str) -> None:
        receipt = self.desk.press(verb, by=self.name, question=question, text=words)
        self._show(receipt.message if receipt.accepted else f"{receipt.message}. {self._choices(self.desk.view())}")

    def _choices(self, view: View) -> str:
        """The keys that mean something now."""
        verbs = [verb for verb in Verb if verb in view.accepts]
        keys = [f"[{self._keymap.name(verb)}] {verb.words}" for verb in verbs]
        if _is_scored(view):
            keys[verbs.index(Verb.ACCEPT)] = "[0]-[9] accept, as bad or good as that"
        return "  ".join([*keys, "[?] help"])

    def _describe(self, view: View) -> str:
        """The view as text."""
        situation = view.situation
        lines = []
        if view.phase in (Phase.PAUSED, Phase.SUSPENDED):
            lines.append(f"Paused: {view.reason}.")
        elif situation is not None and view.phase is Phase.BEFORE:
            lines += [f"Next: {situation.title}.", *filter(None, (situation.instruction, view.status.remark))]
        elif situation is not None and view.phase is Phase.AFTER:
            lines.append(f"Ended: {situation.title}: {situation.outcome}.")
        elif situation is not None and view.phase is Phase.RUNNING:
            lines.append(f"Running: {situation.title}.")
        lines += [f"! {warning}" for warning in view.status.warnings]
        lines.append(self._choices(view))
        return "\n".join(lines)


def _is_scored(view: View) -> bool:
    """Whether a digit accepts the trial that is asked about."""
    return view.situation is not None and view.situation.score_by_operator and Verb.ACCEPT in view.accepts

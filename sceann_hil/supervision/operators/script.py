"""An operator that follows a script: for tests and rehearsals."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import dataclass

from sceann_hil.supervision.operators.desk import Desk
from sceann_hil.supervision.operators.messages import View
from sceann_hil.supervision.operators.operator import Operator
from sceann_hil.supervision.operators.verbs import ACCEPTED, Phase, Verb

_LINE = re.compile(
    r"^(?:(?P<phase>[a-z]+)\s*:\s*)?(?P<verb>[a-z_]+)(?:\s+after\s+(?P<delay>\d+(?:\.\d+)?)\s*s)?(?:\s+(?P<text>.+))?$"
)
_WAITING = (Phase.BEFORE, Phase.AFTER, Phase.PAUSED)
"""Phases in which the run waits for somebody."""


@dataclass(frozen=True, slots=True)
class Step:
    """One line of a script.

    Attributes:
        verb: what is said.
        phase: in which phase; None for the next one that accepts it.
        delay_s: how long after that phase began.
        text: words that come with it.
    """

    verb: Verb
    phase: Phase | None = None
    delay_s: float = 0.0
    text: str = ""

    @classmethod
    def parse(cls, line: str) -> Step:
        """``[PHASE:] VERB [after SECONDS s] [WORDS]``, such as ``running: stop after 0.5 s`` or ``discard it slipped``.

        Raises:
            ValueError: it is something else, or says something that this phase never accepts.
        """
        match = _LINE.match(line.strip())
        try:
            if match is None:
                raise ValueError
            verb = Verb(match["verb"])
            phase = Phase(match["phase"]) if match["phase"] else None
        except ValueError:
            verbs = ", ".join(verb.value for verb in Verb)
            raise ValueError(
                f"expected [PHASE:] VERB [after SECONDS s] [WORDS], VERB of {verbs}, got {line!r}"
            ) from None
        if phase is not None and verb not in ACCEPTED[phase]:
            raise ValueError(f"phase {phase.value} never accepts {verb.value}, got {line!r}")
        if verb.wants_text and not match["text"]:
            raise ValueError(f"expected words after {verb.value}, got {line!r}")
        return cls(verb, phase, float(match["delay"] or 0.0), match["text"] or "")


class Script(Operator):
    """Presses one step after the other; when it has nothing to say to a question, the run ends safely.

    Args:
        desk: where to press.
        steps: in order.
        repeat: start again after the last step.
    """

    name = "script"

    def __init__(self, desk: Desk, steps: Sequence[Step], *, repeat: bool = False) -> None:
        super().__init__(desk)
        self._steps = list(steps)
        self._repeat = repeat and bool(steps)

    def _serve(self) -> None:
        left = list(self._steps)
        view = self.desk.view()
        while not self._leaving.is_set() and view.phase is not Phase.CLOSED:
            if not left and self._repeat:
                left = list(self._steps)
            if left and self._is_due(left[0], view):
                self._say(left.pop(0), view)
            elif view.phase in _WAITING and not view.finishing:
                if not left:
                    self.end_safely("the operator script ran out")
                else:
                    self.end_safely(f"the operator script says {left[0].verb.value}, which is no answer here")
            view = self._wait(view)

    @staticmethod
    def _is_due(step: Step, view: View) -> bool:
        return step.verb in view.accepts and step.phase in (None, view.phase)

    def _say(self, step: Step, view: View) -> None:
        due_s = time.monotonic() + step.delay_s
        now = view
        while (left_s := due_s - time.monotonic()) > 0 and not self._leaving.is_set():
            now = self.desk.wait(now.version, left_s)
            if (now.phase, now.question) != (view.phase, view.question):
                return
        question = view.question if step.verb.is_answer else None
        self.desk.press(step.verb, by=self.name, question=question, text=step.text)

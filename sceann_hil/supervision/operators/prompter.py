"""Makes a question heard at the machine that the run is on: a bell, or a voice where a speech program is installed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress

from sceann_hil.supervision.operators.desk import Desk
from sceann_hil.supervision.operators.messages import View
from sceann_hil.supervision.operators.operator import Operator
from sceann_hil.supervision.operators.settings import Prompt
from sceann_hil.supervision.operators.verbs import Phase

SPEECH_PROGRAMS = ("spd-say", "espeak-ng", "espeak", "say")


def ring() -> None:
    """Ring the bell of the terminal that errors go to; printing libraries take it for rubbish."""
    if sys.stderr is not None and sys.stderr.isatty():
        with suppress(OSError):
            sys.stderr.write("\a")
            sys.stderr.flush()


class Prompter(Operator):
    """Rings or speaks once for every question; it never presses anything.

    Args:
        desk: whose questions.
        prompt: bell or speech.
        ring: rings the terminal's bell.
    """

    name = "prompter"

    def __init__(self, desk: Desk, prompt: Prompt, ring: Callable[[], object]) -> None:
        super().__init__(desk)
        self._prompt = prompt
        self._ring = ring
        self._program = next(filter(None, map(shutil.which, SPEECH_PROGRAMS)), None)

    def _serve(self) -> None:
        asked = 0
        view = self.desk.view()
        while not self._leaving.is_set() and view.phase is not Phase.CLOSED:
            if view.question > asked and view.phase in (Phase.BEFORE, Phase.AFTER):
                asked = view.question
                self._tell(view)
            view = self._wait(view)

    def _tell(self, view: View) -> None:
        if self._prompt is Prompt.BELL or self._program is None or view.situation is None:
            self._ring()
            return
        words = view.situation.instruction if view.phase is Phase.BEFORE else view.situation.outcome
        subprocess.run([self._program, words], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)

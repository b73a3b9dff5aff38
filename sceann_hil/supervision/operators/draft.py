"""Words that are being typed at a console, one key after the other."""

from __future__ import annotations

import unicodedata

from sceann_hil.supervision.operators.hits import Hit
from sceann_hil.supervision.operators.keymap import BACKSPACE, DELETE_LINE, ENTER, ESCAPE

_JOINERS = "\u200d\ufe0e\ufe0f"


class Draft:
    """A line with an end that can be taken back.

    Attributes:
        text: so far.
        given_up: Escape was hit.
        done: nothing is typed any more.
    """

    def __init__(self) -> None:
        self.text = ""
        self.given_up = False
        self.done = False

    def take(self, hit: Hit) -> None:
        """One more key, or the whole line where lines are all that there is."""
        if hit.line is not None:
            self.text, self.done = hit.line, True
        elif hit.key == ENTER:
            self.done = True
        elif hit.key == ESCAPE:
            self.given_up = self.done = True
        elif hit.key == BACKSPACE:
            self._take_back()
        elif hit.key == DELETE_LINE:
            self.text = ""
        elif len(hit.key) == 1 and (hit.key.isprintable() or hit.key in _JOINERS):
            self.text += hit.key

    def _take_back(self) -> None:
        """What a person sees as the last character: an accent that was typed for itself goes with its letter."""
        while self.text and (unicodedata.combining(self.text[-1]) or self.text[-1] in _JOINERS):
            self.text = self.text[:-1]
        self.text = self.text[:-1]

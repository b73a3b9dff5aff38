"""One way of standing beside the robot: it shows the desk's view and presses verbs, in a thread of its own."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self

from sceann_hil.supervision.operators.desk import Desk
from sceann_hil.supervision.operators.messages import View
from sceann_hil.supervision.operators.verbs import Phase, Verb


class Operator(ABC):
    """Somebody at a `Desk`. Use it in a ``with`` block.

    Attributes:
        name: by which the others and the journal know this operator.
        desk: where it presses.
    """

    name: str

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self._leaving = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=f"operator {type(self).__name__}", daemon=True)

    @abstractmethod
    def _serve(self) -> None:
        """Show and press until `_leaving` is set."""

    def start(self) -> None:
        """Come to the desk.

        Raises:
            UserError: it cannot; nothing has moved yet.
        """
        self._thread.start()

    def stop(self) -> None:
        """Leave the desk. May be called twice."""
        self._leaving.set()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(timeout=2.0)

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def end_safely(self, why: str) -> None:
        """Nobody is there any more: stop what runs, let nothing count that was not judged, end the run in good order.

        Args:
            why: for the journal.
        """
        while not self._leaving.is_set():
            view = self.desk.view()
            if view.phase is Phase.RUNNING and Verb.STOP in view.accepts:
                self.desk.press(Verb.STOP, by=self.name)
            if view.phase is Phase.AFTER:
                self.desk.press(Verb.DISCARD, by=self.name, question=view.question, text=why)
            if view.phase is Phase.CLOSED:
                return
            if not view.finishing:
                self.desk.press(Verb.NOTE, by=self.name, text=why)
                self.desk.press(Verb.FINISH, by=self.name)
            self._wait(view)

    def _wait(self, view: View) -> View:
        """The next view, or the same one after a while."""
        return self.desk.wait(view.version, 0.1)

"""The desk between the run and the people beside it: all their words go over it, the first answer wins.

The run asks and waits in its own thread; operators press in theirs. What is accepted follows `ACCEPTED`; everything
else is refused with a reason and changes nothing.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

from sceann_hil.robot import EmergencyStop, EndReason
from sceann_hil.supervision.operators.messages import Finished, Press, Receipt, Situation, Status, View
from sceann_hil.supervision.operators.verbs import ACCEPTED, SCORES, Phase, Verb
from sceann_hil.supervision.operators.words import clean
from sceann_hil.supervision.stopping import Stopped, StopReason, StopRequest, nobody

POLL_S = 0.2
"""How often a waiting run looks whether the command line wants it to stop."""

HISTORY = 12
"""Trials that a display can show."""
_ENDS_TRIAL = {
    Verb.STOP: EndReason.OPERATOR,
    Verb.PAUSE_NOW: EndReason.OPERATOR,
    Verb.GOAL: EndReason.GOAL,
    Verb.EMERGENCY_STOP: EndReason.EMERGENCY_STOP,
}


@dataclass(slots=True)
class Flight:
    """A trial that runs.

    Attributes:
        ended_by: what an operator said to end it; None if nobody did.
        cut_off: why something else than an operator ended it; empty if nothing did.
    """

    ended_by: Verb | None = None
    cut_off: str = ""

    @property
    def words(self) -> str:
        """Who or what ended it."""
        if self.ended_by is None:
            return self.cut_off
        return f"{self.ended_by.words} by an operator"

    @property
    def void_reason(self) -> EndReason | None:
        """Why its result does not count; None if it does."""
        if self.ended_by is None and self.cut_off:
            return EndReason.OPERATOR
        reason = _ENDS_TRIAL[self.ended_by] if self.ended_by else None
        return reason if reason is not None and reason.is_void else None


class Desk:
    """Where one run meets its operators. All methods may be called from any thread.

    Args:
        asks: whether anybody is there to be asked before and after trials.
        on_emergency: called at once, in the presser's thread, when somebody presses the emergency stop between trials.
        stop: what somebody outside wants, asked while the run waits here; it ends the waiting with `Stopped`.

    Attributes:
        typing: words that are being typed at the console, for whoever draws there: on a terminal a line belongs to
            one of them only.
    """

    def __init__(
        self,
        *,
        asks: bool = True,
        on_emergency: Callable[[str], object] = lambda _: None,
        stop: Callable[[], StopRequest] = nobody,
    ) -> None:
        self.asks = asks
        self.typing = ""
        self._on_emergency = on_emergency
        self._stop = stop
        self._changed = threading.Condition()
        self._view = View(accepts=ACCEPTED[Phase.IDLE])
        self._questions = 0
        self._presses = 0
        self._phase_since_s = time.monotonic()
        self._answer: Press | None = None
        self._flight: Flight | None = None
        self._interrupt: Callable[[EndReason], object] | None = None
        self._emergency: Press | None = None
        self._queue: deque[Press] = deque()
        self._seen_s = time.monotonic()
        self._paused_s = 0.0
        self._held = False

    # -- for operators ----------------------------------------------------------------------------------------------

    def press(self, verb: Verb, *, by: str, question: int | None = None, text: str = "") -> Receipt:
        """Say something to the run.

        Args:
            verb: what.
            by: who says it.
            question: number of the question that is answered, as the operator saw it; None if the operator cannot
                have seen an older one.
            text: words, for DISCARD and NOTE, and the score, where ACCEPT needs one, in whatever shape they arrived;
                what is kept of them is `clean`.

        Returns:
            Whether it was accepted. A refused press changes nothing.
        """
        end: Callable[[], object] | None = None
        text = clean(text)
        with self._changed:
            self._seen_s = time.monotonic()
            refusal = self._refusal(verb, question, text)
            if refusal:
                return Receipt(False, refusal)
            self._presses += 1
            waited_s = time.monotonic() - self._phase_since_s
            press = Press(self._presses, verb, by, self._view.phase, text, waited_s)
            self._queue.append(press)
            end = self._take(press)
            self._view = replace(self._view, version=self._view.version + 1, last=press)
            self._changed.notify_all()
        if end is not None:
            end()
        return Receipt(True, f"{verb.words}: taken")

    def _refusal(self, verb: Verb, question: int | None, text: str) -> str:
        view, name = self._view, verb.words
        if verb.is_answer and question is not None and question != view.question:
            last = self._answer
            told = f"{last.by} said {last.verb.words}" if last is not None else "it is not asked"
            return f"{name}: this question is not open any more: {told}"
        if verb not in view.accepts:
            return f"{name}: not possible now ({view.phase.value})"
        if verb.wants_text and not text:
            return f"{name}: say why"
        scored = view.situation is not None and view.situation.score_by_operator
        if verb is Verb.ACCEPT and scored and text not in SCORES:
            return f"{name}: say how good it was, 0 to 9"
        return ""

    def _take(self, press: Press) -> Callable[[], object] | None:
        """Carry out what an accepted press means; returns what must be done without the lock."""
        verb, phase = press.verb, self._view.phase
        if verb is Verb.EMERGENCY_STOP:
            self._emergency = press
            interrupt, reason = self._interrupt, "emergency stop pressed"
            if self._flight is not None:
                self._flight.ended_by = verb
            self._set_phase(Phase.CLOSED, reason=f"emergency stop, pressed by {press.by}")
            if interrupt is not None:
                return partial(interrupt, EndReason.EMERGENCY_STOP)
            return partial(self._on_emergency, reason)
        if verb is Verb.FINISH:
            self._view = replace(self._view, finishing=True)
        if verb in (Verb.PAUSE_AFTER, Verb.PAUSE_NOW):
            self._view = replace(self._view, pausing=True)
            if phase is Phase.BEFORE:
                self._set_phase(Phase.IDLE)
        if verb is Verb.RESUME:
            self._view = replace(self._view, pausing=False)
            self._set_phase(Phase.IDLE)
        if phase is Phase.RUNNING and verb in _ENDS_TRIAL and self._flight is not None:
            self._flight.ended_by = verb
            self._view = replace(self._view, accepts=self._view.accepts - {Verb.STOP, Verb.GOAL, Verb.PAUSE_NOW})
            interrupt = self._interrupt
            if interrupt is not None:
                return partial(interrupt, _ENDS_TRIAL[verb])
        if verb.is_answer and phase in (Phase.BEFORE, Phase.AFTER):
            self._answer = press
            self._set_phase(Phase.IDLE)
        return None

    def view(self) -> View:
        """What there is to show now."""
        with self._changed:
            return self._view

    def wait(self, version: int, timeout_s: float) -> View:
        """What there is to show once it is newer than `version`, or after `timeout_s`."""
        with self._changed:
            self._changed.wait_for(lambda: self._view.version > version, timeout_s)
            return self._view

    def seen(self) -> None:
        """Somebody is there (a browser is connected, a key was hit)."""
        with self._changed:
            self._seen_s = time.monotonic()

    # -- for the run ------------------------------------------------------------------------------------------------

    @property
    def absent_s(self) -> float:
        """Time since an operator was last seen."""
        with self._changed:
            return time.monotonic() - self._seen_s

    def ask(self, phase: Phase, situation: Situation) -> Press:
        """Ask before or after a trial and wait for the first answer; pauses happen here.

        Raises:
            Stopped: an operator wants the run to end (before a trial only: a trial that ran gets its verdict first).
            EmergencyStop: somebody pressed it.
        """
        while True:
            if phase is Phase.BEFORE:
                self.between()
            with self._changed:
                self._raise_if_closed()
                self._questions += 1
                self._answer = None
                self._set_phase(phase, situation=situation, question=self._questions)
                self._wait_until(lambda: self._answered(phase))
                self._raise_if_closed()
                answer = self._answer
                if answer is None:
                    self._set_phase(Phase.IDLE)
                    continue
            if answer.verb is Verb.ABORT:
                raise Stopped(StopReason.OPERATOR, f"{answer.by} ended the run before a trial")
            return answer

    def _answered(self, phase: Phase) -> bool:
        """Something was said that ends the waiting; a pause or the end of the run withdraws the question before."""
        withdrawn = phase is Phase.BEFORE and (self._view.pausing or self._view.finishing)
        return self._answer is not None or self._emergency is not None or withdrawn

    def cut_off(self, why: str) -> None:
        """End the trial that runs, from outside the desk (a signal): it is void for this reason. Never waits."""
        interrupt = None
        with self._changed:
            if self._flight is not None and not self._flight.cut_off:
                self._flight.cut_off = why
                interrupt = self._interrupt
        if interrupt is not None:
            interrupt(EndReason.OPERATOR)

    def hold(self, held: bool) -> None:
        """While it is held, no trial begins (the process is about to be stopped)."""
        with self._changed:
            self._held = held
            self._changed.notify_all()

    def pause(self, by: str) -> None:
        """Pause before the next trial, if anybody is there who can end the pause."""
        if self.asks:
            self.press(Verb.PAUSE_AFTER, by=by)

    @contextmanager
    def flight(self, situation: Situation, interrupt: Callable[[EndReason], object]) -> Iterator[Flight]:
        """A trial runs inside this block; `interrupt` ends it from an operator's thread."""
        with self._changed:
            self._changed.wait_for(lambda: not self._held)
            self._raise_if_closed()
            flight = self._flight = Flight()
            self._interrupt = interrupt
            self._set_phase(Phase.RUNNING, situation=situation)
            if not situation.goal_by_operator:
                self._view = replace(self._view, accepts=self._view.accepts - {Verb.GOAL})
        try:
            yield flight
        finally:
            with self._changed:
                self._flight = self._interrupt = None
                if self._view.phase is not Phase.CLOSED:
                    self._set_phase(Phase.IDLE, situation=situation)

    def between(self) -> None:
        """Between trials: pause as long as an operator wants to.

        Raises:
            Stopped: an operator wants the run to end.
            EmergencyStop: somebody pressed it.
        """
        with self._changed:
            self._raise_if_closed()
            if self._view.pausing and not self._view.finishing:
                self._set_phase(Phase.PAUSED, reason=self._who_paused())
                began_s = time.monotonic()
                self._wait_until(lambda: not self._view.pausing or self._view.finishing or self._emergency is not None)
                self._paused_s += time.monotonic() - began_s
                self._raise_if_closed()
                self._set_phase(Phase.IDLE)
            if self._view.finishing:
                raise Stopped(StopReason.OPERATOR, f"{self._last_by(Verb.FINISH)} finished the run")

    def suspend(self, reason: str, timeout_s: float) -> None:
        """Wait in phase SUSPENDED for at most `timeout_s`, or until an operator says something that matters.

        Raises:
            Stopped, EmergencyStop: as in `between`.
        """
        with self._changed:
            self._raise_if_closed()
            if self._view.phase is not Phase.SUSPENDED or self._view.reason != reason:
                self._set_phase(Phase.SUSPENDED, reason=reason)
            before = self._presses
            began_s = time.monotonic()
            self._changed.wait_for(lambda: self._presses > before or self._emergency is not None, timeout_s)
            self._paused_s += time.monotonic() - began_s
            self._raise_if_closed()
            if (stopped := self._stop().at_once) is not None:
                raise stopped
            if self._view.finishing:
                raise Stopped(StopReason.OPERATOR, f"{self._last_by(Verb.FINISH)} finished the run")

    def unsuspend(self) -> None:
        """The suspenders' reasons are gone."""
        with self._changed:
            if self._view.phase is Phase.SUSPENDED:
                self._set_phase(Phase.IDLE)

    def publish(self, status: Status, finished: Finished | None = None) -> None:
        """Show how run and robot stand, and the trial that just finished."""
        with self._changed:
            history = self._view.history if finished is None else (finished, *self._view.history)[:HISTORY]
            self._view = replace(self._view, status=status, history=history, version=self._view.version + 1)
            self._changed.notify_all()

    def said(self) -> list[Press]:
        """Everything accepted since the last call, in order, for the journal."""
        with self._changed:
            presses = list(self._queue)
            self._queue.clear()
            return presses

    def paused_s(self) -> float:
        """Time spent in pauses so far."""
        with self._changed:
            return self._paused_s

    def close(self, reason: str) -> None:
        """The run is over."""
        with self._changed:
            if self._view.phase is not Phase.CLOSED:
                self._set_phase(Phase.CLOSED, reason=reason)

    def _wait_until(self, happened: Callable[[], bool]) -> None:
        while not self._changed.wait_for(happened, POLL_S):
            if (stopped := self._stop().at_once) is not None:
                self._set_phase(Phase.IDLE)
                raise stopped

    def _set_phase(
        self, phase: Phase, *, situation: Situation | None = None, question: int = 0, reason: str = ""
    ) -> None:
        self._phase_since_s = time.monotonic()
        self._view = replace(
            self._view,
            version=self._view.version + 1,
            phase=phase,
            question=question,
            situation=situation or self._view.situation,
            reason=reason,
            accepts=ACCEPTED[phase],
        )
        self._changed.notify_all()

    def _raise_if_closed(self) -> None:
        if self._emergency is not None:
            raise EmergencyStop(f"{self._emergency.by} pressed the emergency stop")

    def _who_paused(self) -> str:
        return f"paused by {self._last_by(Verb.PAUSE_AFTER, Verb.PAUSE_NOW)}"

    def _last_by(self, *verbs: Verb) -> str:
        last = self._view.last
        return last.by if last is not None and last.verb in verbs else "an operator"

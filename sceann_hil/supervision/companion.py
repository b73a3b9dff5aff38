"""Who has a say between trials, as the evaluator sees it: nobody, or operator, budget and suspenders together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from sceann_hil.journal import Circumstances, Slots
from sceann_hil.robot import Results, RobotError, Trials
from sceann_hil.robot.task import Task
from sceann_hil.supervision.stopping import Stopped


@dataclass(frozen=True, slots=True)
class Attended:
    """What became of trials in company.

    Attributes:
        results: of the trials; void where somebody said so.
        circumstances: for the journal.
        at_once: run a void trial again before all others.
        then: raised once the results are in the journal.
    """

    results: Results
    circumstances: Circumstances = field(default_factory=Circumstances)
    at_once: bool = False
    then: Stopped | RobotError | None = None


class Companion(Protocol):
    """Who has a say between trials. It may take its time, and may end the run by raising `Stopped`."""

    def begin(self, generation: int, todo: int, total: int) -> None:
        """A generation is about to be evaluated; `todo` of its `total` trials are still to be run."""

    def room(self, wanted: int) -> int:
        """How many of so many trials may be run at once, at least 1."""

    def ready(self, generation: int, slots: Slots) -> bool:
        """These attempts are next; False to come back to them after the generation's others."""

    def attend(
        self, generation: int, slots: Slots, trials: Trials, run: Callable[[Trials], Results], task: Task
    ) -> Attended:
        """Run the trials and say whether their results count."""


class Alone:
    """Nobody has a say."""

    def begin(self, generation: int, todo: int, total: int) -> None:
        """Nothing to say."""

    def room(self, wanted: int) -> int:
        return wanted

    def ready(self, generation: int, slots: Slots) -> bool:
        return True

    def attend(
        self, generation: int, slots: Slots, trials: Trials, run: Callable[[Trials], Results], task: Task
    ) -> Attended:
        return Attended(run(trials))


class Stoppable:
    """A companion beside whom somebody may stop the run.

    Args:
        companion: who else has a say.
        stop: asked before every batch; True ends the evaluation with `Stopped`.
    """

    def __init__(self, companion: Companion, stop: Callable[[], bool]) -> None:
        self._companion = companion
        self._stop = stop
        self.begin = companion.begin
        self.room = companion.room
        self.attend = companion.attend

    def ready(self, generation: int, slots: Slots) -> bool:
        if self._stop():
            raise Stopped
        return self._companion.ready(generation, slots)

"""Who has a say between trials, as the trial runner sees it: nobody, or operator, budget and suspenders together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from sceann_hil.journal import Circumstances, Slots
from sceann_hil.robot import Results, RobotError, Trials
from sceann_hil.robot.task import Task
from sceann_hil.supervision.stopping import Stopped


@dataclass(frozen=True, slots=True)
class Upcoming:
    """Attempts that are next.

    Attributes:
        slots: what they are for.
        generation: that the run is in.
        heading: what they are, in a few words for people; empty for an individual's trials in its generation.
        remark: what people should know of them, in a sentence or two.
        besides: they are none of the trials that `Companion.begin` told of.
        settling: they were begun before, by a process that was cut off, and the robot is asked how they ended.
    """

    slots: Slots
    generation: int
    heading: str = ""
    remark: str = ""
    besides: bool = False
    settling: bool = False

    def __len__(self) -> int:
        return len(self.slots)


@dataclass(frozen=True, slots=True)
class Attended:
    """What became of trials in somebody's presence.

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
        """A generation (or a measurement) begins; `todo` of its `total` trials are still to be run."""

    def room(self, wanted: int) -> int:
        """How many of so many trials may be run at once, at least 1."""

    def clear(self, upcoming: Upcoming) -> None:
        """Return when nothing forbids these attempts: no pause, no suspender, no budget. Nobody is asked."""

    def ready(self, upcoming: Upcoming) -> bool:
        """Like `clear`, and a person is asked; False to come back to these attempts after the others."""

    def attend(self, upcoming: Upcoming, trials: Trials, run: Callable[[Trials], Results], task: Task) -> Attended:
        """Run the trials and say whether their results count."""

    def warn(self, warning: str) -> None:
        """Show people something that is wrong from now on."""


class Alone:
    """Nobody has a say."""

    def begin(self, generation: int, todo: int, total: int) -> None:
        """Nothing to say."""

    def room(self, wanted: int) -> int:
        return wanted

    def clear(self, upcoming: Upcoming) -> None:
        """Nothing forbids anything."""

    def ready(self, upcoming: Upcoming) -> bool:
        return True

    def attend(self, upcoming: Upcoming, trials: Trials, run: Callable[[Trials], Results], task: Task) -> Attended:
        return Attended(run(trials))

    def warn(self, warning: str) -> None:
        """Nobody reads it."""

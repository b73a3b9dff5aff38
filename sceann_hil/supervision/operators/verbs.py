"""What an operator can say, and when: one table that every way of saying it obeys."""

from __future__ import annotations

from enum import StrEnum


class Phase(StrEnum):
    """What the run does while a person stands beside it."""

    IDLE = "idle"
    """Between trials; nothing is asked."""
    BEFORE = "before"
    """A trial waits for a person to make the robot ready."""
    RUNNING = "running"
    """A trial runs."""
    AFTER = "after"
    """A trial has ended and waits for a verdict."""
    PAUSED = "paused"
    """A person wanted a pause."""
    SUSPENDED = "suspended"
    """A suspender wanted a pause (battery, temperature, ...) and will end it by itself."""
    CLOSED = "closed"
    """The run is over, or was stopped for good."""


class Verb(StrEnum):
    """What an operator can say."""

    READY = "ready"
    """Before a trial: the robot stands where it should, go."""
    SKIP = "skip"
    """Before a trial: not now; it comes again after the generation's other trials."""
    ABORT = "abort"
    """Before a trial: do not run it, end the run in good order."""
    STOP = "stop"
    """During a trial: stop the robot; the attempt is void and the trial comes again."""
    GOAL = "goal"
    """During a trial: the goal is reached (for tasks whose robot cannot tell)."""
    ACCEPT = "accept"
    """After a trial: it counts."""
    REDO = "redo"
    """After a trial: it does not count and is run again at once."""
    DISCARD = "discard"
    """After a trial: it does not count, for the reason given; it comes again after the generation's others."""
    NOTE = "note"
    """Any time: words that the journal keeps with the trial, or with the run if there is none."""
    PAUSE_AFTER = "pause_after"
    """Any time: pause after this trial."""
    PAUSE_NOW = "pause_now"
    """Any time: pause at once; a trial that runs is stopped and void."""
    RESUME = "resume"
    """In a pause: go on."""
    FINISH = "finish"
    """Any time: after this trial end the run in good order."""
    EMERGENCY_STOP = "emergency_stop"
    """Any time: stop the robot by every means and end the run; a person must look."""
    BATTERY_SWAPPED = "battery_swapped"
    """Between trials: the robot has a full battery."""

    @property
    def words(self) -> str:
        """Its name for people: the same at the console, on the page and in the documentation."""
        return self.value.replace("_", " ")

    @property
    def means(self) -> str:
        """What it does, in a few words."""
        return _MEANS[self]

    @property
    def wants_text(self) -> bool:
        """Words must come with it."""
        return self in (Verb.DISCARD, Verb.NOTE)

    @property
    def is_answer(self) -> bool:
        """It answers the question before or after a trial."""
        return self in ACCEPTED[Phase.BEFORE] - _EVER or self in ACCEPTED[Phase.AFTER] - _EVER


SCORES = frozenset("0123456789")
"""What comes with ACCEPT where the task lets a person say how good a trial was."""

_MEANS = {
    Verb.READY: "it stands right, go",
    Verb.SKIP: "comes again after the others",
    Verb.ABORT: "end the run without this trial",
    Verb.STOP: "void, comes again",
    Verb.GOAL: "the goal is reached",
    Verb.ACCEPT: "it counts",
    Verb.REDO: "void, again at once",
    Verb.DISCARD: "void, for a reason; comes again later",
    Verb.NOTE: "words for the journal",
    Verb.PAUSE_AFTER: "after this trial",
    Verb.PAUSE_NOW: "a trial that runs is void",
    Verb.RESUME: "go on",
    Verb.FINISH: "end the run after this trial",
    Verb.EMERGENCY_STOP: "by every means; ends the run",
    Verb.BATTERY_SWAPPED: "the robot has a full one",
}

_EVER = frozenset({Verb.NOTE, Verb.PAUSE_AFTER, Verb.PAUSE_NOW, Verb.FINISH, Verb.EMERGENCY_STOP, Verb.BATTERY_SWAPPED})

ACCEPTED: dict[Phase, frozenset[Verb]] = {
    Phase.IDLE: _EVER,
    Phase.BEFORE: _EVER | {Verb.READY, Verb.SKIP, Verb.ABORT},
    Phase.RUNNING: (_EVER - {Verb.BATTERY_SWAPPED}) | {Verb.STOP, Verb.GOAL},
    Phase.AFTER: _EVER | {Verb.ACCEPT, Verb.REDO, Verb.DISCARD},
    Phase.PAUSED: (_EVER - {Verb.PAUSE_AFTER, Verb.PAUSE_NOW}) | {Verb.RESUME},
    Phase.SUSPENDED: _EVER,
    Phase.CLOSED: frozenset(),
}
"""What is accepted in each phase. Besides: GOAL only if the task asks for it; of STOP, GOAL and PAUSE_NOW only the
first in a trial; DISCARD and NOTE only with words; an answer only to the question that is open."""

"""What the run shows to its operators, and what they say to it."""

from __future__ import annotations

from dataclasses import dataclass, field

from sceann_hil.supervision.operators.verbs import Phase, Verb


@dataclass(frozen=True, slots=True)
class Situation:
    """The trial that is asked about, or runs.

    Attributes:
        generation: its generation.
        individual: place of its individual in the generation.
        trial: which of the individual's trials.
        attempt: 0, and one more for each time that it came to nothing.
        instruction: what a person has to do before it starts.
        start: names and values of the start, in the order of the robot's start fields.
        goal_by_operator: whether a person says that the goal is reached.
        score_by_operator: whether a person says how good it was: ACCEPT comes with a digit.
        outcome: how it ended, in words; empty before that.
        heading: what it is, for a trial outside selection; empty for an individual's in its generation.
    """

    generation: int
    individual: int
    trial: int
    attempt: int
    instruction: str
    start: tuple[tuple[str, float], ...] = ()
    goal_by_operator: bool = False
    score_by_operator: bool = False
    outcome: str = ""
    heading: str = ""

    @property
    def title(self) -> str:
        """Which trial this is, in a few words."""
        again = f", attempt {self.attempt + 1}" if self.attempt else ""
        if self.heading:
            return self.heading + again
        return f"generation {self.generation}, individual {self.individual}, trial {self.trial}{again}"


@dataclass(frozen=True, slots=True)
class Status:
    """How run and robot stand, for display.

    Attributes:
        run: name of the run.
        robot: name of the robot.
        robot_ok: what it says of itself.
        robot_messages: most important first.
        link_quality: part 0..1 of the last trial's messages that came through at the first try; None without a link.
        battery_fraction: 0..1, or None where it is not measured.
        done: trials of this generation that are counted.
        todo: trials of this generation in all.
        generation: number of the generation.
        generations: number of the last one.
        robot_s: robot time so far.
        wall_s: time so far, without down-time.
        left: what is left of each budget, in words.
        todo_s: about how long the trials take that this generation still needs; None if nobody knows.
        forecast: when the run or its budget ends, in words.
        best: the best individual of this generation so far, in words.
        remark: which trial is next or runs, why, and what is expected, as the algorithm says; empty if it says nothing.
        warnings: what is wrong now; shown as a banner.
    """

    run: str = ""
    robot: str = ""
    robot_ok: bool = True
    robot_messages: tuple[str, ...] = ()
    link_quality: float | None = None
    battery_fraction: float | None = None
    done: int = 0
    todo: int = 0
    generation: int = 0
    generations: int = 0
    robot_s: float = 0.0
    wall_s: float = 0.0
    left: tuple[str, ...] = ()
    todo_s: float | None = None
    forecast: str = ""
    best: str = ""
    remark: str = ""
    warnings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Finished:
    """One of the last trials, for display.

    Attributes:
        title: which trial it was.
        outcome: how it ended.
        duration_s: robot time.
        fitness: None if it does not count.
    """

    title: str
    outcome: str
    duration_s: float
    fitness: float | None


@dataclass(frozen=True, slots=True)
class Press:
    """Something that an operator said and that was accepted.

    Attributes:
        number: counts from 1.
        verb: what was said.
        by: who said it: console, web, script.
        phase: when.
        text: the words that came with it.
        after_s: time between the question, or the phase's beginning, and this.
    """

    number: int
    verb: Verb
    by: str
    phase: Phase
    text: str
    after_s: float


@dataclass(frozen=True, slots=True)
class Receipt:
    """Whether something that was said was accepted, and if not, why not."""

    accepted: bool
    message: str


@dataclass(frozen=True, slots=True)
class View:
    """Everything that an operator's display shows, at one moment.

    Attributes:
        version: grows with every change.
        phase: what the run does.
        question: number of the open question; 0 if there is none.
        situation: the trial in question.
        reason: why the run pauses or ended.
        accepts: what may be said now.
        last: the newest thing that any operator said.
        pausing: a pause will begin after this trial.
        finishing: the run will end after this trial.
        status: how run and robot stand.
        history: the last trials, newest first.
    """

    version: int = 0
    phase: Phase = Phase.IDLE
    question: int = 0
    situation: Situation | None = None
    reason: str = ""
    accepts: frozenset[Verb] = frozenset()
    last: Press | None = None
    pausing: bool = False
    finishing: bool = False
    status: Status = field(default_factory=Status)
    history: tuple[Finished, ...] = ()

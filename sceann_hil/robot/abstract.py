"""A body that runs trials: what every backend implements."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from sceann_hil.robot.diagnosis import Finding, Mover, Verdict
from sceann_hil.robot.drawing import Drawing
from sceann_hil.robot.durations import Durations
from sceann_hil.robot.end_reasons import EndReason, RobotError
from sceann_hil.robot.facts import GapEstimate, Health, RobotSpec
from sceann_hil.robot.trials import Results, Trace, Trials

UNKNOWN_STATE = np.zeros(0, np.float32)
"""The state of a body that nobody knows."""


class TrialObserver(Protocol):
    """Somebody who watches trials while they run. No method waits or raises."""

    def begin(self, trial_id: int) -> None:
        """A trial starts; its number in the journal."""

    def step(self, step: int, sensors: NDArray[np.uint16], state: NDArray[np.float32]) -> None:
        """What the controller saw in one step, and the body's state before it (empty where nobody knows it)."""

    def end(self) -> None:
        """The trial is over."""


class Robot(ABC):
    """A body that runs trials. Level 1: what every backend implements."""

    @property
    @abstractmethod
    def spec(self) -> RobotSpec:
        """What this robot is; readable before `connect`."""

    @property
    def identity(self) -> str | None:
        """What tells this robot from all others, once it is connected; None where nothing does."""
        return None

    @property
    def drawing(self) -> Drawing | None:
        """What it looks like, for viewers; None if there is nothing to draw but signals."""
        return None

    @abstractmethod
    def run(self, trials: Trials) -> Results:
        """Run the trials and tell what happened.

        Raises:
            ValueError: the network does not fit the robot.
            RobotError: see the subclasses.
        """

    def trace(self, trials: Trials) -> Results:
        """Like `run`, with a `Trace` of every trial; only a deterministic robot can be asked this about the past.

        Raises:
            NotImplementedError: this robot delivers its traces with `run`, or not at all.
        """
        raise NotImplementedError(f"{self.spec.name} cannot repeat a trial")

    def estimate_gap(self, starts: NDArray[np.float64], traces: Sequence[Trace]) -> GapEstimate:
        """The gap with which this simulated body would behave like the robot that the traces are of.

        Args:
            starts: start values of each trace's trial, shape ``(n, n_start)``.
            traces: at least one of more than 2 steps.

        Raises:
            NotImplementedError: this robot is not simulated.
        """
        raise NotImplementedError(f"{self.spec.name} is not simulated")

    def settle(self, trials: Trials) -> Results:
        """What became of trials whose start was journalled and whose outcome never was (the host died in between).

        A deterministic robot simply runs them again. Any other must not make up a result: unless it remembers the
        trial, the attempt is void.
        """
        if self.spec.deterministic:
            return self.run(trials)
        return Results.void(len(trials), EndReason.LINK_LOST, len(self.spec.state_fields))

    def body_fingerprint(self) -> str | None:
        """What a simulated body's motion follows from (code, constants, parameters) in one word; None for others.

        Two robots with the same one give the same bits; a journal notes it.
        """
        return None

    def connect(self) -> None:
        """Make the robot ready; motors stay at their safe output. Does nothing where there is nothing to do."""

    def disconnect(self) -> None:
        """Motors safe, then let go. May be called twice."""
        self.make_safe("disconnect")

    def use_cores(self, count: int) -> None:
        """Compute on at most `count` cores; does nothing where nothing is computed."""

    def make_safe(self, reason: str) -> bool:
        """Bring the motors to their safe output; never raises.

        Returns:
            True if the robot acknowledged it.
        """
        return True

    def interrupt(self, reason: EndReason) -> None:
        """End the trial that runs, if any; called from another thread than `run`, and must not wait.

        `run` then returns as soon as the motors are safe, with this end reason if the robot can do that. By default the
        motors go to their safe output and `run` sees for itself.

        Args:
            reason: OPERATOR, BATTERY, GOAL (a person says that the task is done), or EMERGENCY_STOP (stop by every
                means there is).
        """
        self.make_safe(str(reason))

    @property
    def timing(self) -> dict[str, Durations]:
        """Histograms of what took how long since the robot was connected, by name: round trips, lateness, ..."""
        return {}

    def health(self) -> Health:
        """State of the robot, without side effects; may be called from another thread while a trial runs."""
        return Health()

    def probe(self) -> None:
        """Find out how the robot is now, without moving it; never raises.

        Called every half second while a run waits for a better battery or link: a robot that knows its state only from
        its trials, or was switched off meanwhile, brings `health` up to date here.
        """

    def observe(self, observer: TrialObserver | None) -> None:
        """Let somebody watch trials while they run. A robot that is faster than any eye tells nothing."""

    def diagnose(self, mover: Mover | None = None) -> Iterator[Finding]:
        """Look at the robot, not connected before, and tell what is found; safe at any time.

        Args:
            mover: lets the robot do each of its movements; None: it must not move.
        """
        try:
            self.connect()
        except RobotError as error:
            yield Finding("connection", Verdict.BAD, str(error))
            return
        health = self.health()
        yield Finding(
            "health", Verdict.GOOD if health.ok else Verdict.BAD, ", ".join(health.messages) or "nothing to say"
        )
        self.disconnect()

    def __enter__(self) -> Self:
        self.connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.disconnect()

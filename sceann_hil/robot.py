"""The abstract Robot: run these trials and tell what happened.

A simulated robot runs a whole batch in one compiled call; a physical one runs trials one by one. The evaluator never
asks which it has: it reads the robot's `RobotSpec`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from types import TracebackType
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from sceann_hil.coding import NetworkSize, Weights
from sceann_hil.controller import Dynamics
from sceann_hil.diagnosis import Finding, Verdict
from sceann_hil.durations import Durations
from sceann_hil.scenery import Scenery


class EndReason(IntEnum):
    """Why a trial ended. The numbers are stored in journals and sent over the link; they never change.

    Task ends are results. Void ends say that nothing was measured: no fitness is ever made of them.
    """

    TIME_UP = 0
    GOAL = 1
    FELL = 2
    OUT_OF_BOUNDS = 3
    LINK_LOST = 16
    BATTERY = 17
    OPERATOR = 18
    FAULT = 19
    EMERGENCY_STOP = 20
    OVERRUN = 21

    def __str__(self) -> str:
        return self.name.lower().replace("_", " ")

    @property
    def is_void(self) -> bool:
        """True if the trial measured nothing and must never reach selection."""
        return self >= EndReason.LINK_LOST


class RobotError(Exception):
    """Something about the robot; the subclasses say what happens next."""


class LinkError(RobotError):
    """The robot cannot be reached: retry, then pause the run."""


class TrialVoid(RobotError):
    """This attempt measured nothing: attempt the trial again within the retry limit."""


class RobotFault(RobotError):
    """The robot is not as it should be: halt, a person must look."""


class EmergencyStop(RobotError):
    """Somebody pressed stop: halt."""


@dataclass(frozen=True, slots=True)
class RobotSpec:
    """What a robot is, readable before it is connected.

    Attributes:
        name: a short name for messages.
        n_sensors: sensor values per tick, in the order of the controller's sensor neurons.
        n_motors: motor neurons it listens to.
        tick_s: length of one control step.
        start_fields: names, with units, of a trial's start values.
        state_fields: names, with units, of the body's state in traces and final states.
        attended: a person stands beside it, so prompts make sense.
        batch_size: how many trials `Robot.run` takes at once; None for any number.
        repeatable: the same trial gives the same bits again, so nothing is lost by running it twice.
        noise_free: a trial's noise key has no influence on it, so equal weights and starts give equal results.
    """

    name: str
    n_sensors: int
    n_motors: int
    tick_s: float
    start_fields: tuple[str, ...]
    state_fields: tuple[str, ...]
    attended: bool = False
    batch_size: int | None = None
    repeatable: bool = True
    noise_free: bool = False


@dataclass(frozen=True, slots=True)
class Trials:
    """Trials to run, as a structure of arrays (n trials, g genomes).

    Attributes:
        size: the network's size, the same for all.
        dynamics: the neuron's reading, the same for all.
        weights: connection matrices, int8, shape ``(g, n_neurons, n_sources)``.
        genome_index: which of them each trial uses, int32, shape ``(n,)``.
        starts: start values in the order of `RobotSpec.start_fields`, float64, shape ``(n, n_start)``.
        keys: 64-bit noise keys from the seed tree, uint64, shape ``(n,)``.
        max_steps: a trial that reaches this many steps ends with `EndReason.TIME_UP`.
        ids: numbers that name the trials in the journal, int64, shape ``(n,)``.
        run_id: a number that tells this run from others, so that a robot's memory of another run's trial is not
            taken for one of this run's.
    """

    size: NetworkSize
    dynamics: Dynamics
    weights: Weights
    genome_index: NDArray[np.int32]
    starts: NDArray[np.float64]
    keys: NDArray[np.uint64]
    max_steps: int
    ids: NDArray[np.int64]
    run_id: int = 0

    @classmethod
    def none(cls, size: NetworkSize, n_start: int) -> Self:
        """No trials at all, of the right types."""
        return cls(
            size=size,
            dynamics=Dynamics(),
            weights=np.zeros((0, size.n_neurons, size.n_sources), np.int8),
            genome_index=np.zeros(0, np.int32),
            starts=np.zeros((0, n_start)),
            keys=np.zeros(0, np.uint64),
            max_steps=1,
            ids=np.zeros(0, np.int64),
        )

    def __len__(self) -> int:
        return len(self.genome_index)

    def take(self, which: slice | NDArray[np.intp]) -> Trials:
        """Some of the trials, in the order asked for."""
        return Trials(
            self.size,
            self.dynamics,
            self.weights,
            self.genome_index[which],
            self.starts[which],
            self.keys[which],
            self.max_steps,
            self.ids[which],
            self.run_id,
        )

    def batches(self, batch_size: int | None) -> Iterator[Trials]:
        """The trials in consecutive batches that a robot can take."""
        step = batch_size or max(len(self), 1)
        for first in range(0, len(self), step):
            yield self.take(slice(first, first + step))


@dataclass(frozen=True, slots=True)
class Trace:
    """Everything about one trial, step by step (n steps).

    Attributes:
        state: body state before each step and after the last, float32, shape ``(n + 1, n_state)``; no columns
            where the robot cannot know it.
        sensors: wire values 0..1023 that the controller saw, uint16, shape ``(n, n_sensors)``.
        u: neuron states after each step, int16 Q10, shape ``(n, n_neurons)``.
        x: neuron outputs after each step, int16 Q10, shape ``(n, n_neurons)``; the motors are the last columns.
    """

    state: NDArray[np.float32]
    sensors: NDArray[np.uint16]
    u: NDArray[np.int16]
    x: NDArray[np.int16]


@dataclass(frozen=True, slots=True)
class Results:
    """What happened in n trials, in the order they were given.

    Attributes:
        end_reasons: values of `EndReason`, uint8, shape ``(n,)``.
        steps: control steps done, int32, shape ``(n,)``.
        hashes: CRC-16 of all neuron states (`sceann_hil.controller.state_hash`), uint16, shape ``(n,)``.
        final_states: body state after the last step, float32, shape ``(n, n_state)``.
        durations_s: robot time of each trial (steps times tick in simulation), float64, shape ``(n,)``.
        traces: one trace per trial, where the robot delivers them.
    """

    end_reasons: NDArray[np.uint8]
    steps: NDArray[np.int32]
    hashes: NDArray[np.uint16]
    final_states: NDArray[np.float32]
    durations_s: NDArray[np.float64]
    traces: Sequence[Trace] | None = None

    @classmethod
    def void(cls, n: int, reason: EndReason, n_state: int) -> Self:
        """Results of n trials that measured nothing."""
        return cls(
            end_reasons=np.full(n, reason, np.uint8),
            steps=np.zeros(n, np.int32),
            hashes=np.zeros(n, np.uint16),
            final_states=np.zeros((n, n_state), np.float32),
            durations_s=np.zeros(n, np.float64),
        )

    def __len__(self) -> int:
        return len(self.end_reasons)


@dataclass(frozen=True, slots=True)
class Health:
    """What a robot says of itself between trials.

    Attributes:
        ok: trials may run.
        battery_fraction: 0..1, or None where it is not measured.
        temperature_c: degrees Celsius, or None where it is not measured.
        link_quality: part 0..1 of the last trial's messages that came through at the first try; None where there is no
            link.
        messages: what a person should know, most important first.
    """

    ok: bool = True
    battery_fraction: float | None = None
    messages: tuple[str, ...] = field(default=())
    temperature_c: float | None = None
    link_quality: float | None = None


@dataclass(frozen=True, slots=True)
class GapEstimate:
    """The gap with which a simulated body behaves like a robot.

    Attributes:
        sensor_offset: of each sensor, in units of full scale.
        motor_gain: factor on every motor's distance from standing still.
        latency_steps: control steps between a motor value and its effect.
        residual: root mean square of the sensors' differences that are left, in units of full scale.
    """

    sensor_offset: tuple[float, ...]
    motor_gain: float
    latency_steps: int
    residual: float


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
    def scenery(self) -> Scenery | None:
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
        """Like `run`, with a `Trace` of every trial; only a repeatable robot can be asked this about the past.

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

        A repeatable robot simply runs them again. Any other must not make up a result: unless it remembers the
        trial, the attempt is void.
        """
        if self.spec.repeatable:
            return self.run(trials)
        return Results.void(len(trials), EndReason.LINK_LOST, len(self.spec.state_fields))

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

    def observe(self, observer: TrialObserver | None) -> None:
        """Let somebody watch trials while they run. A robot that is faster than any eye tells nothing."""

    def diagnose(self, *, may_move: bool) -> Iterator[Finding]:
        """Look at the robot, not connected before, and tell what is found; safe at any time.

        Args:
            may_move: somebody has seen to it that the robot may move for a moment.
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

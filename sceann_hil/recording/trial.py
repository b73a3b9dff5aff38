"""What a recording is made of: a run, and one attempt of one of its trials with its trace."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Self

from sceann_hil.journal import AttemptRow
from sceann_hil.network.coding import NetworkSize, Weights
from sceann_hil.robot import EndReason, Trace
from sceann_hil.robot.accumulation import Accumulation
from sceann_hil.robot.drawing import Drawing
from sceann_hil.robot.signal_names import motor_names, sensor_names, sensors_from_left

_NOT_IN_AN_ID = re.compile(r"[^A-Za-z0-9_-]+")


@dataclass(frozen=True)
class RecordedRun:
    """What all trials of a run share.

    Attributes:
        name: the run's, first part of every recording id.
        experiment: the rerun application id; runs of one experiment share it.
        robot: name of the robot (the property ``platform``).
        size: of the network.
        tick_s: length of a control step.
        max_steps: step limit of a trial.
        best_fitness: no trial can be worth more.
        state_fields: names of the body's state in traces.
        drawing: what the robot looks like; None for signals only.
        start_fields: names of the values of a trial's start.
        accumulation: what the task adds up over a trial's steps, if it does.
        has_map: its algorithm keeps a map of different controllers.
    """

    name: str
    experiment: str
    robot: str
    size: NetworkSize
    tick_s: float
    max_steps: int
    best_fitness: float
    state_fields: tuple[str, ...]
    drawing: Drawing | None
    start_fields: tuple[str, ...] = ()
    accumulation: Accumulation | None = None
    has_map: bool = False

    @cached_property
    def sensor_names(self) -> tuple[str, ...]:
        """What people call the sensors, in the controller's order."""
        return sensor_names(self.size, self.drawing)

    @cached_property
    def sensors_from_left(self) -> tuple[int, ...]:
        """The sensors as pictures list them: from the robot's left to its right."""
        return sensors_from_left(self.size, self.drawing)

    @cached_property
    def hidden_names(self) -> tuple[str, ...]:
        """Names of the hidden neurons."""
        return self.size.hidden_names

    @cached_property
    def motor_names(self) -> tuple[str, ...]:
        """What people call the motor neurons."""
        return motor_names(self.size, self.drawing)


@dataclass(frozen=True, slots=True)
class RecordedTrial:
    """One attempt of one trial.

    Attributes:
        id: the trial number that users see; the journal's attempt id.
        generation, individual, trial, attempt: its place in the run, all from 0.
        fitness: None if the attempt was void.
        end_reason: why it ended.
        champion: its individual was the best of its generation.
        weights: of its network, shape ``(n_neurons, n_sources)``.
        trace: all that happened.
        start: its start values.
    """

    id: int
    generation: int
    individual: int
    trial: int
    attempt: int
    fitness: float | None
    end_reason: EndReason
    champion: bool
    weights: Weights
    trace: Trace
    start: tuple[float, ...] = ()

    @classmethod
    def of(cls, row: AttemptRow, end_reason: EndReason, trace: Trace, weights: Weights, *, champion: bool) -> Self:
        """An attempt of the journal, with its network and what happened."""
        return cls(
            id=row.id,
            generation=row.own_generation,
            individual=row.individual,
            trial=row.trial,
            attempt=row.attempt,
            fitness=row.fitness,
            end_reason=end_reason,
            champion=champion,
            weights=weights,
            trace=trace,
            start=tuple(row.start),
        )

    @property
    def steps(self) -> int:
        """Control steps done."""
        return len(self.trace.x)

    @property
    def title(self) -> str:
        """What the viewer calls it."""
        again = f" · attempt {self.attempt}" if self.attempt else ""
        return f"#{self.id} · gen {self.generation} · ind {self.individual} · trial {self.trial}{again}"


def as_id(text: str) -> str:
    """`text` with everything that rerun would rename replaced by ``-``."""
    return _NOT_IN_AN_ID.sub("-", text).strip("-") or "run"


def recording_id(run: str, generation: int, individual: int, trial: int, attempt: int) -> str:
    """The rerun recording id of an attempt, such as ``maze_g007_i03_t5``; later attempts end with ``_a1``."""
    again = f"_a{attempt}" if attempt else ""
    return f"{as_id(run)}_g{generation:03}_i{individual:02}_t{trial}{again}"

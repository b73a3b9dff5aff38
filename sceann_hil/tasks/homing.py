"""Homing: goal reach without a beacon that infrared sees; the target is lit by a lamp.

Fitness as in Katada & Nakazawa, Eq. (3), from several places instead of one corner.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sceann_hil.plugins import RobotConfig, StartVariation, TaskConfig
from sceann_hil.robot import EndReason, Results
from sceann_hil.robot.task import Task
from sceann_hil.tasks.drawn_starts import Draw, StartsDrawn, drawing, needs_no_robot
from sceann_hil.tasks.starts import START_FIELDS, TURNS_DEG, Starts, as_rows, instruction, refuse_occupied, turned


class Homing(Task):
    """Fitness of a trial is 1 - steps / max_steps, and 0 if the target was not reached.

    Args:
        max_steps: a trial ends after this many steps.
        starts: x and y in metres, heading in degrees, one trial for each.
        goal_by_operator: a person says when the target is reached.
        draw: starts of trials, from their numbers and keys (see `Task.starts_of`); `starts` if it is not given.
    """

    name = "homing"
    start_fields = START_FIELDS
    best_fitness = 1.0

    def __init__(
        self, max_steps: int, starts: Starts, goal_by_operator: bool = False, draw: Draw | None = None
    ) -> None:
        self.max_steps = max_steps
        self.goal_by_operator = goal_by_operator
        self._given = starts
        self._starts = as_rows(starts)
        self._draw, self.draws_starts = draw, draw is not None

    @property
    def starts(self) -> NDArray[np.float64]:
        return self._starts

    def starts_of(self, trial: NDArray[np.int64], keys: NDArray[np.uint64]) -> NDArray[np.float64]:
        return super().starts_of(trial, keys) if self._draw is None else self._draw(trial, keys)

    def fitness(self, results: Results) -> NDArray[np.float64]:
        return np.where(self.succeeded(results), 1.0 - results.steps / self.max_steps, 0.0)

    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        return np.asarray(results.end_reasons == EndReason.GOAL)

    def instruction(self, trial: int) -> str:
        return instruction(self._given[trial])


class HomingConfig(TaskConfig):
    """Drive to a target that a lamp lights, from several places: as fast as you can."""

    usual_robot: ClassVar[str] = "diffdrive"

    type: Literal["homing"] = "homing"
    max_steps: Annotated[int, Field(ge=1, le=65_535)] = 300
    """Steps after which a trial ends."""
    starts: Starts = ((0.15, 0.15, 45.0), (0.15, 0.15, 225.0), (0.85, 0.15, 0.0), (0.15, 0.85, 270.0))
    """One trial for each: x and y in metres, heading in degrees."""
    starts_drawn: StartsDrawn | None = None
    """Draw the start of every trial from these ranges instead; there are as many trials as `starts` has rows."""
    goal_by_operator: bool = False
    """The robot cannot tell that it reached the target: the person beside it says so."""

    def build(self) -> Homing:
        needs_no_robot(self.starts_drawn)
        return Homing(self.max_steps, self.starts, self.goal_by_operator)

    def build_for(self, robot: RobotConfig) -> Homing:
        return Homing(self.max_steps, self.starts, self.goal_by_operator, drawing(self.starts_drawn, robot))

    def check(self, robot: RobotConfig) -> None:
        if self.starts_drawn is None:
            refuse_occupied(robot, self.starts)
        else:
            self.starts_drawn.check(robot)

    def other_starts(self) -> StartVariation | None:
        if self.starts_drawn is not None:
            return self.starts_drawn.turned()
        changes = tuple({"starts": [list(start) for start in turned(self.starts, turn)]} for turn in TURNS_DEG)
        return StartVariation("initial headings turned by", "degrees", TURNS_DEG, changes)

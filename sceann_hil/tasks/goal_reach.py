"""Reach a target as fast as you can: Katada & Nakazawa, Section III.A, Eq. (3)."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sceann_hil.plugins import Misfit, RobotConfig, StartVariation, TaskConfig
from sceann_hil.robot import EndReason, Results
from sceann_hil.robot.task import Task
from sceann_hil.tasks.drawn_starts import Draw, StartsDrawn, drawing, needs_no_robot

BEST_SCORE = 9
"""What a person can say at most."""


class GoalReach(Task):
    """One trial per initial heading; fitness of a trial is 1 - steps / max_steps, and 0 if the goal was not reached.

    Args:
        max_steps: a trial ends after this many steps.
        start_m: where the robot is put, x and y.
        headings_deg: one trial for each, counter-clockwise from the x axis.
        goal_by_operator: a person says when the goal is reached.
        score_by_operator: a person says after each trial how good it was; a ninth of that is its fitness.
        success_score: from this score on a trial is a success.
        draw: starts of trials, from their numbers and keys (see `Task.starts_of`); `starts` if it is not given.
    """

    name = "goal_reach"
    start_fields = ("x_m", "y_m", "heading_rad")
    best_fitness = 1.0

    def __init__(
        self,
        max_steps: int,
        start_m: tuple[float, float],
        headings_deg: tuple[float, ...],
        goal_by_operator: bool = False,
        score_by_operator: bool = False,
        success_score: int = BEST_SCORE,
        draw: Draw | None = None,
    ) -> None:
        self.max_steps = max_steps
        self.goal_by_operator = goal_by_operator
        self.score_by_operator = score_by_operator
        self._success_score = success_score
        self._draw, self.draws_starts = draw, draw is not None
        headings = np.deg2rad(headings_deg)
        headings = (headings + np.pi) % (2.0 * np.pi) - np.pi
        self._starts = np.column_stack(
            [np.full_like(headings, start_m[0]), np.full_like(headings, start_m[1]), headings]
        )

    @property
    def starts(self) -> NDArray[np.float64]:
        return self._starts

    def starts_of(self, trial: NDArray[np.int64], keys: NDArray[np.uint64]) -> NDArray[np.float64]:
        return super().starts_of(trial, keys) if self._draw is None else self._draw(trial, keys)

    def fitness(self, results: Results) -> NDArray[np.float64]:
        if self.score_by_operator:
            return self._scores(results) / BEST_SCORE
        return np.where(self.succeeded(results), 1.0 - results.steps / self.max_steps, 0.0)

    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        if self.score_by_operator:
            return np.asarray((self._scores(results) >= self._success_score) & results.counts)
        return np.asarray(results.end_reasons == EndReason.GOAL)

    @staticmethod
    def _scores(results: Results) -> NDArray[np.float64]:
        if results.values is None and results.counts.any():
            raise ValueError("results: expected the operator's score of every trial")
        return np.full(len(results), np.nan) if results.values is None else results.values

    def instruction(self, trial: int) -> str:
        x_m, y_m, heading_rad = self.starts[trial].tolist()
        heading_deg = round(np.rad2deg(heading_rad)) % 360
        return (
            f"Put the robot {100 * x_m:.1f} cm from the left and {100 * y_m:.1f} cm from the lower wall, "
            f"heading {heading_deg}° (0° is right, 90° is up)."
        )


class GoalReachConfig(TaskConfig):
    """Drive to the target from a corner, once for each initial heading."""

    usual_robot: ClassVar[str] = "diffdrive"

    type: Literal["goal_reach"] = "goal_reach"
    max_steps: Annotated[int, Field(ge=1, le=65_535)] = 200
    """Steps after which a trial ends (the paper's MaxStep)."""
    start_m: tuple[float, float] = (0.0275, 0.0275)
    """Where the robot is put: x and y, metres. The default touches both walls."""
    headings_deg: Annotated[tuple[float, ...], Field(min_length=1, max_length=1000)] = (
        0.0,
        45.0,
        90.0,
        135.0,
        180.0,
        225.0,
        270.0,
        315.0,
    )
    """One trial for each initial heading, counter-clockwise from the x axis."""
    starts_drawn: StartsDrawn | None = None
    """Draw the start of every trial from these ranges instead; there are as many trials as `headings_deg` has."""
    goal_by_operator: bool = False
    """The robot cannot tell that it reached the target: the person beside it says so."""
    score_by_operator: bool = False
    """The person beside the robot says after every trial how good it was, 0 to 9; a ninth of that is its fitness."""
    success_score: Annotated[int, Field(ge=0, le=9)] = 9
    """With score_by_operator: from this score on a trial is a success."""

    def other_starts(self) -> StartVariation | None:
        if self.starts_drawn is not None:
            return self.starts_drawn.turned()
        turns = (0.0, 5.0, 10.0, 15.0, 20.0, 22.5)
        changes = tuple({"headings_deg": [heading + turn for heading in self.headings_deg]} for turn in turns)
        return StartVariation("initial headings turned by", "degrees", turns, changes)

    def build(self) -> GoalReach:
        needs_no_robot(self.starts_drawn)
        return self._task(None)

    def build_for(self, robot: RobotConfig) -> GoalReach:
        return self._task(drawing(self.starts_drawn, robot))

    def _task(self, draw: Draw | None) -> GoalReach:
        return GoalReach(
            self.max_steps,
            self.start_m,
            self.headings_deg,
            self.goal_by_operator,
            self.score_by_operator,
            self.success_score,
            draw,
        )

    def check(self, robot: RobotConfig) -> None:
        if self.starts_drawn is not None:
            self.starts_drawn.check(robot)
            return
        refusal = robot.refuses_start({"x_m": self.start_m[0], "y_m": self.start_m[1], "heading_rad": 0.0})
        if refusal:
            raise Misfit(f"start_m: {refusal}", "task.start_m")

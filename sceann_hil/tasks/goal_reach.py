"""Reach a target as fast as you can: Katada & Nakazawa, Section III.A, Eq. (3)."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sceann_hil.plugins import Misfit, RobotConfig, StartVariation, TaskConfig
from sceann_hil.robot import Results
from sceann_hil.tasks.drawn_starts import Draw, StartsDrawn, drawing, needs_no_robot
from sceann_hil.tasks.reaching import ReachTarget

BEST_SCORE = 9
"""What a person can say at most."""


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
        return GoalReach(self)

    def build_for(self, robot: RobotConfig) -> GoalReach:
        return GoalReach(self, drawing(self.starts_drawn, robot))

    def check(self, robot: RobotConfig) -> None:
        if self.starts_drawn is not None:
            self.starts_drawn.check(robot)
            return
        refusal = robot.refuses_start({"x_m": self.start_m[0], "y_m": self.start_m[1], "heading_rad": 0.0})
        if refusal:
            raise Misfit(f"start_m: {refusal}", "task.start_m")


class GoalReach(ReachTarget):
    """One trial per initial heading. Where a person says how good it was, a ninth of the score is a trial's fitness.

    Args:
        config: its settings.
        draw: starts of trials, from their numbers and keys (see `Task.starts_of`); those of `config` if it is not
            given.
    """

    name = "goal_reach"

    def __init__(self, config: GoalReachConfig = GoalReachConfig(), draw: Draw | None = None) -> None:  # noqa: B008
        starts = tuple((*config.start_m, heading) for heading in config.headings_deg)
        super().__init__(config.max_steps, starts, config.goal_by_operator, draw)
        self.score_by_operator = config.score_by_operator
        self._success_score = config.success_score

    def fitness(self, results: Results) -> NDArray[np.float64]:
        return self._scores(results) / BEST_SCORE if self.score_by_operator else super().fitness(results)

    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        if self.score_by_operator:
            return np.asarray((self._scores(results) >= self._success_score) & results.counts)
        return super().succeeded(results)

    @staticmethod
    def _scores(results: Results) -> NDArray[np.float64]:
        if results.values is None and results.counts.any():
            raise ValueError("results: expected the operator's score of every trial")
        return np.full(len(results), np.nan) if results.values is None else results.values

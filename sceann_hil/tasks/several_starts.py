"""What the shipped tasks of two-wheeled robots share about their starts: several ones, given or drawn."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated, ClassVar

from pydantic import Field

from sceann_hil.plugins import RobotConfig, StartVariation, TaskConfig
from sceann_hil.robot.task import Task
from sceann_hil.tasks.drawn_starts import Draw, StartsDrawn, drawing, needs_no_robot
from sceann_hil.tasks.starts import TURNS_DEG, Starts, refuse_occupied, turned


class TaskOnAPlane(TaskConfig):
    """A task with several starts, given or drawn, for a robot with two wheels."""

    usual_robot: ClassVar[str] = "diffdrive"

    max_steps: Annotated[int, Field(ge=1, le=65_535)] = 400
    """Steps of a trial."""
    starts: Starts
    """One trial for each: x and y in metres, heading in degrees."""
    starts_drawn: StartsDrawn | None = None
    """Draw the start of every trial from these ranges instead; there are as many trials as `starts` has rows."""

    @abstractmethod
    def task(self, draw: Draw | None) -> Task:
        """The task; `draw` gives the starts of trials, if they are not `starts`."""

    def build(self) -> Task:
        needs_no_robot(self.starts_drawn)
        return self.task(None)

    def build_for(self, robot: RobotConfig) -> Task:
        return self.task(drawing(self.starts_drawn, robot))

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

"""What the shipped tasks of two-wheeled robots share: a value for each step, and which sensors it is about."""

from __future__ import annotations

from abc import abstractmethod
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sceann_hil.plugins import Misfit, RobotConfig
from sceann_hil.robot.step_task import StepTask
from sceann_hil.robot.step_value import StepValue
from sceann_hil.tasks.drawn_starts import Draw
from sceann_hil.tasks.several_starts import TaskOnAPlane
from sceann_hil.tasks.starts import START_FIELDS, as_rows, instruction

SensorNumbers = Annotated[tuple[Annotated[int, Field(ge=0, le=63)], ...], Field(max_length=64)]


class StepTaskOnAPlane(TaskOnAPlane):
    """A task whose fitness is the mean value of a trial's steps, for a robot with two wheels.

    Motor values are 0..1 with 0.5 at rest, as a `world` of the differential drive has them, or with 0 at rest (see
    `forwards_only` of the tasks that are about speed).
    """

    success: Annotated[float, Field(ge=0.0, le=1.0)]
    """A trial that is worth more than this counts as a success."""
    whole_trials: bool = False
    """A trial that ends early, at a bumper for instance, is worth nothing for the steps that it lacks; otherwise its
    fitness is the mean of the steps that it lasted."""

    @abstractmethod
    def value(self) -> StepValue:
        """What a step is worth, 0..1."""

    def sensors_needed(self) -> dict[str, tuple[int, ...]]:
        """Numbers of sensors by the keys that name them."""
        return {}

    def task(self, draw: Draw | None) -> StepTask:
        return StepTask(
            value=self.value(),
            combine="mean_of_all" if self.whole_trials else "mean",
            max_steps=self.max_steps,
            start_fields=START_FIELDS,
            starts=as_rows(self.starts),
            succeeded=self._succeeded,
            best_fitness=1.0,
            worst_fitness=0.0,
            name=self.type,
            instruction=lambda trial: instruction(self.starts[trial]),
            draw=draw,
        )

    def _succeeded(self, fitness: NDArray[np.float64]) -> NDArray[np.bool_]:
        return np.asarray(fitness > self.success)

    def check(self, robot: RobotConfig) -> None:
        spec = robot.spec
        if spec.n_motors != 2:
            raise Misfit(
                f"the task {self.type} is for a robot with two wheels; robot {robot.type} has {spec.n_motors} motors",
                "task.type",
                "robot.type",
            )
        for key, numbers in self.sensors_needed().items():
            for number in numbers:
                if number >= spec.n_sensors:
                    raise Misfit(
                        f"{key}: expected numbers of the robot's {spec.n_sensors} sensors, 0..{spec.n_sensors - 1}, "
                        f"got {number}",
                        f"task.{key}",
                    )
        super().check(robot)

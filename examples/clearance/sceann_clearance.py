"""Obstacle avoidance: drive fast, straight, and far from walls (Floreano and Mondada 1994)."""

from math import radians
from typing import Annotated, Literal

from pydantic import Field

from sceann_hil.plugins import TaskConfig
from sceann_hil.tasks import StepTask, max_of, sqrt, step_value


@step_value
def avoid(sensors, motors, state):
    left, right = motors[0], motors[1]
    return 0.5 * (left + right) * (1 - sqrt(abs(left - right))) * (1 - max_of(sensors))


class Clearance(TaskConfig):
    """Keep clear of walls: mean over the trial of speed, straightness and distance, each 0..1."""

    type: Literal["clearance"] = "clearance"
    max_steps: Annotated[int, Field(ge=1, le=65_535)] = 400
    """Steps after which a trial ends."""
    start_m: tuple[float, float] = (0.15, 0.15)
    """Where the robot is put: x and y, metres."""
    headings_deg: Annotated[tuple[float, ...], Field(min_length=1, max_length=100)] = (0.0, 120.0, 240.0)
    """One trial for each initial heading."""

    def build(self) -> StepTask:
        return StepTask(
            value=avoid,
            combine="mean",
            max_steps=self.max_steps,
            start_fields=("x_m", "y_m", "heading_rad"),
            starts=[(*self.start_m, radians(heading)) for heading in self.headings_deg],
            succeeded=lambda fitness: fitness > 0.3,
            best_fitness=1.0,
            worst_fitness=0.0,
        )

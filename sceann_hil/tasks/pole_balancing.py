"""Keep a pole up and its cart on the track: Katada & Nakazawa, Section IV.A."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sceann_hil.plugins import StartVariation, TaskConfig
from sceann_hil.robot import EndReason, Results
from sceann_hil.robot.task import Task


class PoleBalancingConfig(TaskConfig):
    """Balance a pole on a cart for as long as possible, in one deterministic trial."""

    usual_robot: ClassVar[str] = "cartpole"

    type: Literal["pole_balancing"] = "pole_balancing"
    max_steps: Annotated[int, Field(ge=1, le=65_535)] = 3000
    """Steps after which the pole counts as balanced."""
    start_angle_deg: Annotated[float, Field(ge=-36.0, le=36.0)] = 1.0
    """Initial angle of the pole."""

    def other_starts(self) -> StartVariation:
        before = self.start_angle_deg
        levels = (before, *(angle for angle in (2.0, 4.0, 6.0, 8.0, 12.0) if angle != before))
        changes = tuple({"start_angle_deg": angle} for angle in levels)
        return StartVariation("initial angle", "degrees", levels, changes)

    def build(self) -> PoleBalancing:
        return PoleBalancing(self)


class PoleBalancing(Task):
    """One trial from a slightly tilted pole; fitness is the number of steps balanced.

    Args:
        config: its settings; a trial that lasts all its steps is a success.
    """

    name = "pole_balancing"
    start_fields = ("x_m", "velocity_m_s", "angle_rad", "angular_velocity_rad_s")

    def __init__(self, config: PoleBalancingConfig = PoleBalancingConfig()) -> None:  # noqa: B008
        self.max_steps = config.max_steps
        self.best_fitness = float(config.max_steps)
        self._starts = np.array([[0.0, 0.0, np.deg2rad(config.start_angle_deg), 0.0]])

    @property
    def starts(self) -> NDArray[np.float64]:
        return self._starts

    def fitness(self, results: Results) -> NDArray[np.float64]:
        # the step in which the pole or the cart went over is not one in which it was balanced
        return np.where(self.succeeded(results), results.steps, results.steps - 1).astype(np.float64)

    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        return np.asarray(results.end_reasons == EndReason.TIME_UP)

    def instruction(self, trial: int) -> str:
        angle_deg = np.rad2deg(self._starts[trial, 2])
        return (
            f"Put the cart in the middle of its track, at rest, and hold the pole at {angle_deg:+.1f}° (to the right)."
        )

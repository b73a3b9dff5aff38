"""Keep a pole up and its cart on the track: Katada & Nakazawa, Section IV.A."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sceann_hil.plugins import Misfit, StartVariation, TaskConfig
from sceann_hil.robot import EndReason, Results
from sceann_hil.robot.task import Task
from sceann_hil.seeds import Purpose, uniforms
from sceann_hil.seeds import keys as stream_keys

Angle = Annotated[float, Field(ge=-36.0, le=36.0)]


class PoleBalancingConfig(TaskConfig):
    """Balance a pole on a cart for as long as possible, in one deterministic trial."""

    usual_robot: ClassVar[str] = "cartpole"

    type: Literal["pole_balancing"] = "pole_balancing"
    max_steps: Annotated[int, Field(ge=1, le=65_535)] = 3000
    """Steps after which the pole counts as balanced."""
    start_angle_deg: Angle = 1.0
    """Initial angle of the pole."""
    start_angle_drawn_deg: tuple[Angle, Angle] | None = None
    """Draw the initial angle of every trial from this range instead, from and to."""
    trials: Annotated[int, Field(ge=1, le=1000)] = 1
    """Trials of one individual; more than one only where their angle is drawn."""

    @model_validator(mode="after")
    def _trials_differ(self) -> Self:
        drawn = self.start_angle_drawn_deg
        if drawn is not None and drawn[0] > drawn[1]:
            raise Misfit(
                f"start_angle_drawn_deg: expected the smaller value first, got {list(drawn)}", "start_angle_drawn_deg"
            )
        if drawn is None and self.trials > 1:
            raise Misfit(
                f"trials: expected 1, got {self.trials}: without start_angle_drawn_deg they are all the same",
                "trials",
                "start_angle_drawn_deg",
            )
        return self

    def other_starts(self) -> StartVariation:
        drawn = self.start_angle_drawn_deg
        if drawn is not None:
            widths = (1.0, 1.5, 2.0, 3.0)
            wider = [[max(-36.0, width * drawn[0]), min(36.0, width * drawn[1])] for width in widths]
            return StartVariation(
                "initial angles times", "", widths, tuple({"start_angle_drawn_deg": angles} for angles in wider)
            )
        before = self.start_angle_deg
        levels = (before, *(angle for angle in (2.0, 4.0, 6.0, 8.0, 12.0) if angle != before))
        changes = tuple({"start_angle_deg": angle} for angle in levels)
        return StartVariation("initial angle", "degrees", levels, changes)

    def build(self) -> PoleBalancing:
        return PoleBalancing(self)


class PoleBalancing(Task):
    """One trial from a slightly tilted pole, or some from drawn angles; fitness is the number of steps balanced.

    Args:
        config: its settings; a trial that lasts all its steps is a success.
    """

    name = "pole_balancing"
    start_fields = ("x_m", "velocity_m_s", "angle_rad", "angular_velocity_rad_s")

    def __init__(self, config: PoleBalancingConfig = PoleBalancingConfig()) -> None:  # noqa: B008
        self.max_steps = config.max_steps
        self.best_fitness = float(config.max_steps)
        self._starts = np.tile([0.0, 0.0, np.deg2rad(config.start_angle_deg), 0.0], (config.trials, 1))
        self._drawn_deg = config.start_angle_drawn_deg
        self.draws_starts = self._drawn_deg is not None

    @property
    def starts(self) -> NDArray[np.float64]:
        return self._starts

    def starts_of(self, trial: NDArray[np.int64], keys: NDArray[np.uint64]) -> NDArray[np.float64]:
        starts = super().starts_of(trial, keys)
        if self._drawn_deg is not None:
            low, high = self._drawn_deg
            drawn = low + (high - low) * uniforms(stream_keys(keys, Purpose.START, trial), 1)
            starts = starts.copy()
            starts[:, 2] = np.deg2rad(drawn[:, 0])
        return starts

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

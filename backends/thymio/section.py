"""What the sections of a Thymio and of its twin share."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from backends.thymio.readings import GROUND_BLACK, GROUND_WHITE
from sceann_hil.firmware.aesl.program import TOP_TARGET, Life, Senses
from sceann_hil.plugins import Misfit, RobotConfig

START_FIELDS = ("x_m", "y_m", "heading_rad")


class ThymioSection(RobotConfig):
    """A Thymio II, real or simulated."""

    tick_s: Annotated[float, Field(ge=0.01, le=1.0)] = 0.1
    """Control step, seconds, in whole milliseconds."""
    sensors: Annotated[tuple[Literal["infrared", "ground"], ...], Field(min_length=1, max_length=2)] = ("infrared",)
    """infrared: the seven of prox.horizontal, 1 at contact. ground: the two of prox.ground.delta, 1 over white."""
    top_target: Annotated[int, Field(ge=1, le=TOP_TARGET)] = TOP_TARGET
    """Motor target of a motor neuron at 0 (backwards) or 1 (forwards); at 0.5 the motor stands still."""
    ground_black: Annotated[int, Field(ge=0, le=1023)] = GROUND_BLACK
    """What prox.ground.delta reads over the darkest floor; the default is the simulator's."""
    ground_white: Annotated[int, Field(ge=0, le=1023)] = GROUND_WHITE
    """What prox.ground.delta reads over the lightest floor; the default is the simulator's."""

    @model_validator(mode="after")
    def _has_a_life(self) -> Self:
        if len(set(self.sensors)) < len(self.sensors) or self.sensors == ("ground", "infrared"):
            raise Misfit("sensors: expected [infrared], [ground] or [infrared, ground]", "sensors")
        try:
            _ = self.aesl_life
        except ValueError as error:
            raise Misfit(str(error), str(error).partition(":")[0]) from None
        return self

    @property
    def aesl_life(self) -> Life:
        senses = Senses("infrared" in self.sensors, "ground" in self.sensors)
        return Life(self.tick_s, senses, self.top_target, self.ground_black, self.ground_white)

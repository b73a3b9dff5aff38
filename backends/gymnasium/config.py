"""The ``robot`` section of type ``gymnasium``."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from backends.gymnasium.environment import Facts, Option, facts
from backends.gymnasium.robot import GymnasiumRobot, Wiring
from sceann_hil.plugins import Misfit, RobotConfig, Section
from sceann_hil.robot import EndReason, RobotSpec

TaskEnd = Literal["goal", "fell", "out_of_bounds"]
START_FIELDS = ("seed",)


class SensorConfig(Section):
    """One number of the observation as a sensor."""

    observation: Annotated[int, Field(ge=0)]
    """Which number, from 0."""
    at_0: float | None = None
    """The number that reads 0; default: the lower bound that the environment gives."""
    at_1: float | None = None
    """The number that reads 1; default: the upper bound that the environment gives."""


class MotorConfig(Section):
    """One number of the action as a motor."""

    at_0: float | None = None
    """The number at motor value 0; default: the lower bound that the environment gives."""
    at_1: float | None = None
    """The number at motor value 1; default: the upper bound that the environment gives."""


class GymnasiumConfig(RobotConfig):
    """A Gymnasium environment, MuJoCo's among them, as a simulated robot."""

    type: Literal["gymnasium"] = "gymnasium"
    env: Annotated[str, Field(min_length=1)]
    """The environment's id, such as CartPole-v1 or InvertedPendulum-v5; package:Id imports the package first."""
    options: dict[str, Option] = Field(default_factory=dict)
    """What gymnasium.make is given besides the id."""
    sensors: Annotated[tuple[SensorConfig, ...], Field(min_length=1, max_length=64)]
    """Which numbers of the observation the controller sees, and their scales."""
    motors: Annotated[tuple[MotorConfig, ...], Field(max_length=16)] = ()
    """Scales of the action's numbers; none for a choice, which one motor makes in equal parts of 0..1."""
    tick_s: Annotated[float, Field(gt=0.0, le=10.0)] | None = None
    """Length of a step; default: what the environment says."""
    terminated: TaskEnd = "fell"
    """What it means when the environment says that the episode has terminated."""
    truncated: TaskEnd = "out_of_bounds"
    """What it means when the environment itself says that the episode is truncated."""

    @model_validator(mode="after")
    def _fits_the_environment(self) -> Self:
        try:
            found = facts(self.env, self.options)
        except ValueError as error:
            raise Misfit(str(error), "env", "options") from error
        if self.tick_s is None and found.tick_s is None:
            raise Misfit(f"tick_s: expected a number, because {self.env} does not say how long a step is", "tick_s")
        for place, sensor in enumerate(self.sensors):
            if sensor.observation >= len(found.low):
                raise Misfit(
                    f"sensors[{place}].observation: expected 0..{len(found.low) - 1}, got {sensor.observation}",
                    "sensors",
                )
        n_motors = 1 if found.n_actions else len(found.action_low)
        if self.motors and (found.n_actions or len(self.motors) != n_motors):
            expected = "none, because the action is a choice" if found.n_actions else str(n_motors)
            raise Misfit(f"motors: expected {expected}, got {len(self.motors)}", "motors")
        for key, rows in (("sensors", self._sensor_scales(found)), ("motors", self._motor_scales(found))):
            for place, (at_0, at_1) in enumerate(rows):
                if not np.isfinite([at_0, at_1]).all() or at_0 == at_1:
                    raise Misfit(
                        f"{key}[{place}]: expected different finite at_0 and at_1, got {at_0:g} and {at_1:g} "
                        f"({self.env} gives no bounds here)",
                        key,
                    )
        return self

    def _sensor_scales(self, found: Facts) -> list[tuple[float, float]]:
        return [
            (
                found.low[it.observation] if it.at_0 is None else it.at_0,
                found.high[it.observation] if it.at_1 is None else it.at_1,
            )
            for it in self.sensors
        ]

    def _motor_scales(self, found: Facts) -> list[tuple[float, float]]:
        given = self.motors or tuple(MotorConfig() for _ in found.action_low)
        bounds = zip(given, found.action_low, found.action_high, strict=True)
        return [(low if it.at_0 is None else it.at_0, high if it.at_1 is None else it.at_1) for it, low, high in bounds]

    @property
    def spec(self) -> RobotSpec:
        found = facts(self.env, self.options)
        return RobotSpec(
            name=f"gymnasium {self.env}",
            n_sensors=len(self.sensors),
            n_motors=1 if found.n_actions else len(found.action_low),
            tick_s=self.tick_s or found.tick_s or 1.0,
            start_fields=START_FIELDS,
            state_fields=tuple(f"observation_{k}" for k in range(len(found.low))),
            batch_size=None,
            deterministic=True,
            noise_free=True,
        )

    def build(self) -> GymnasiumRobot:
        found = facts(self.env, self.options)
        wiring = Wiring(
            observation=np.array([it.observation for it in self.sensors]),
            sensor_scales=np.array(self._sensor_scales(found)),
            n_actions=found.n_actions,
            motor_scales=np.array(self._motor_scales(found)).reshape(-1, 2),
            terminated=EndReason[self.terminated.upper()],
            truncated=EndReason[self.truncated.upper()],
        )
        return GymnasiumRobot(self.spec, self.env, dict(self.options), wiring)

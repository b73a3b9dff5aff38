"""The `gap` section of a simulated robot's configuration."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Self

from pydantic import Field, model_validator

from backends.simulation.gap import MAX_LATENCY_STEPS, Gap, Spread, Spreads, each
from sceann_hil.plugins import Misfit, Section


class UniformSpread(Section):
    """Drawn evenly between two numbers."""

    uniform: tuple[float, float]
    """Smallest and largest value."""

    @model_validator(mode="after")
    def _right_way_up(self) -> Self:
        low, high = self.uniform
        if low > high:
            raise ValueError(f"uniform: expected [smallest, largest], got [{low:g}, {high:g}]")
        return self

    def spread(self) -> Spread:
        """The same for the simulation."""
        low, high = self.uniform
        return Spread(centre=(low + high) / 2.0, half_width=(high - low) / 2.0)


class NormalSpread(Section):
    """Drawn from a normal distribution."""

    normal: tuple[float, Annotated[float, Field(ge=0.0)]]
    """Mean and standard deviation."""

    def spread(self) -> Spread:
        """The same for the simulation."""
        mean, deviation = self.normal
        return Spread(centre=mean, deviation=deviation)


Quantity = float | UniformSpread | NormalSpread
"""A fixed number, ``{uniform: [smallest, largest]}`` or ``{normal: [mean, deviation]}``."""

OneOrEach = Quantity | Annotated[tuple[Quantity, ...], Field(min_length=1)]
"""One quantity for all sensors or motors, or a list with one for each."""


class Drawn(StrEnum):
    """When quantities that are not fixed are drawn."""

    PER_TRIAL = "per_trial"
    """Anew for every trial."""
    PER_ROBOT = "per_robot"
    """Once for the robot's whole life."""


class GapConfig(Section):
    """How the simulated body differs from the ideal one. The defaults are no gap at all: the paper's body."""

    sensor_offset: OneOrEach = 0.0
    """Added to every sensor value, in units of full scale; drawn per sensor, or a list with one for each sensor."""
    sensor_gain: OneOrEach = 1.0
    """Factor on every sensor value; drawn per sensor, or a list with one for each sensor."""
    sensor_noise: Quantity = 0.0
    """Standard deviation of the noise on every sensor value, in units of full scale."""
    motor_gain: OneOrEach = 1.0
    """Factor on every motor's distance from standing still; drawn per motor, or a list with one for each motor."""
    motor_dead_band: Quantity = 0.0
    """Distance from standing still, in units of full scale, below which a motor does not move."""
    latency_steps: Quantity = 0.0
    """Control steps between a motor value and its effect, rounded, at most 15."""

    drawn: Drawn = Drawn.PER_TRIAL
    """per_trial draws what is not fixed anew for every trial, per_robot once for the robot's whole life."""
    robot: Annotated[int, Field(ge=0, lt=2**63)] = 0
    """With `drawn: per_robot`, which robot: another number is another one."""

    def build(self, n_sensors: int, n_motors: int) -> Gap:
        """The same for the simulation.

        Args:
            n_sensors: sensors of the body.
            n_motors: its motors.

        Raises:
            Misfit: a latency is not in 0..`MAX_LATENCY_STEPS`, or a list has another length than the body has sensors
                or motors.
        """
        latency = _spread(self.latency_steps)
        low, high = latency.centre - latency.half_width, latency.centre + latency.half_width
        if low < 0.0 or high > MAX_LATENCY_STEPS:
            raise Misfit(
                f"latency_steps: expected 0..{MAX_LATENCY_STEPS} steps, got {low:g}..{high:g}", "gap.latency_steps"
            )
        return Gap(
            sensor_offset=_spreads("sensor_offset", self.sensor_offset, n_sensors, "sensors"),
            sensor_gain=_spreads("sensor_gain", self.sensor_gain, n_sensors, "sensors"),
            sensor_noise=_spread(self.sensor_noise),
            motor_gain=_spreads("motor_gain", self.motor_gain, n_motors, "motors"),
            motor_dead_band=_spread(self.motor_dead_band),
            latency_steps=latency,
            robot_number=self.robot if self.drawn is Drawn.PER_ROBOT else None,
        )


def values_of_gap(key: str, n_sensors: int, n_motors: int) -> int:
    """How many values a key of a body takes, as `RobotConfig.values_of` tells it, if all its lists are in its gap."""
    if key in ("gap.sensor_offset", "gap.sensor_gain"):
        return n_sensors
    return n_motors if key == "gap.motor_gain" else 1


def _spreads(name: str, quantity: OneOrEach, count: int, things: str) -> Spreads:
    if not isinstance(quantity, tuple):
        return _spread(quantity)
    spreads = tuple(_spread(one) for one in quantity)
    try:
        each(name, spreads, count, things)
    except ValueError as error:
        raise Misfit(str(error), f"gap.{name}") from None
    # so many equal values are one value for all: a list of defaults is no gap
    return spreads[0] if len(set(spreads)) == 1 else spreads


def _spread(quantity: Quantity) -> Spread:
    return Spread(float(quantity)) if isinstance(quantity, (int, float)) else quantity.spread()

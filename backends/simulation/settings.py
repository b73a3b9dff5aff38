"""The `gap` section of a simulated robot's configuration."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import Field, model_validator

from backends.simulation.gap import MAX_LATENCY_STEPS, Gap, Spread
from sceann_hil.plugins import Misfit, Section


class UniformSpread(Section):
    """Drawn evenly between two numbers, anew for every trial."""

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
    """Drawn from a normal distribution, anew for every trial."""

    normal: tuple[float, Annotated[float, Field(ge=0.0)]]
    """Mean and standard deviation."""

    def spread(self) -> Spread:
        """The same for the simulation."""
        mean, deviation = self.normal
        return Spread(centre=mean, deviation=deviation)


Quantity = float | UniformSpread | NormalSpread
"""A fixed number, ``{uniform: [smallest, largest]}`` or ``{normal: [mean, deviation]}``."""


class GapConfig(Section):
    """How the simulated body differs from the ideal one. The defaults are no gap at all: the paper's body."""

    sensor_offset: Quantity = 0.0
    """Added to every sensor value, in units of full scale; drawn per sensor."""
    sensor_gain: Quantity = 1.0
    """Factor on every sensor value; drawn per sensor."""
    sensor_noise: Quantity = 0.0
    """Standard deviation of the noise on every sensor value, in units of full scale."""
    motor_gain: Quantity = 1.0
    """Factor on every motor's distance from standing still; drawn per motor."""
    motor_dead_band: Quantity = 0.0
    """Distance from standing still, in units of full scale, below which a motor does not move."""
    latency_steps: Quantity = 0.0
    """Control steps between a motor value and its effect, rounded, at most 15."""

    def build(self) -> Gap:
        """The same for the simulation.

        Raises:
            Misfit: a latency is not in 0..`MAX_LATENCY_STEPS`.
        """
        spreads = {name: _spread(getattr(self, name)) for name in type(self).model_fields}
        latency = spreads["latency_steps"]
        low, high = latency.centre - latency.half_width, latency.centre + latency.half_width
        if low < 0.0 or high > MAX_LATENCY_STEPS:
            raise Misfit(
                f"latency_steps: expected 0..{MAX_LATENCY_STEPS} steps, got {low:g}..{high:g}", "gap.latency_steps"
            )
        return Gap(**spreads)


def _spread(quantity: Quantity) -> Spread:
    return Spread(float(quantity)) if isinstance(quantity, (int, float)) else quantity.spread()

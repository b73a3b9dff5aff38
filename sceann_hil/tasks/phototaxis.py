"""Phototaxis: go to the light and stay there; after V. Braitenberg, Vehicles (1984), and Nolfi and Floreano (2000).

A step is worth the brightest reading of the light sensors.
"""

from __future__ import annotations

from typing import Literal

from sceann_hil.robot.step_value import Floats, StepValue, step_value
from sceann_hil.tasks.on_a_plane import SensorNumbers, StepTaskOnAPlane
from sceann_hil.tasks.readings import strongest
from sceann_hil.tasks.starts import Starts


class PhototaxisConfig(StepTaskOnAPlane):
    """Go to the light and stay there: a step is worth the brightest reading of the light sensors."""

    type: Literal["phototaxis"] = "phototaxis"
    starts: Starts = ((0.15, 0.15, 45.0), (0.15, 0.15, 225.0), (0.85, 0.15, 0.0), (0.15, 0.85, 270.0))
    """One trial for each: x and y in metres, heading in degrees."""
    success: float = 0.5
    """A trial that is worth more than this counts as a success."""
    light_sensors: SensorNumbers = ()
    """Numbers of the light sensors; all sensors if none is given."""

    def sensors_needed(self) -> dict[str, tuple[int, ...]]:
        return {"light_sensors": self.light_sensors}

    def value(self) -> StepValue:
        brightest = strongest(self.light_sensors)

        def brightness(sensors: Floats, motors: Floats) -> float:
            return brightest(sensors)

        return step_value(brightness)

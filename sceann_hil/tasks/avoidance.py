"""Obstacle avoidance: D. Floreano and F. Mondada, Automatic creation of an autonomous agent (SAB 1994), Eq. (1).

A step is worth ``V (1 - sqrt(dv)) (1 - i)``: V is the mean speed of the wheels, dv the difference of their signed
speeds, i the reading of the distance sensor that reads most; all 0..1. So it drives fast, straight, away from walls.
In the paper V has no sign; here only driving forwards counts unless `backwards_counts` is set.
"""

from __future__ import annotations

from typing import Literal

from sceann_hil.robot.step_value import Floats, StepValue, sqrt, step_value
from sceann_hil.tasks.on_a_plane import SensorNumbers
from sceann_hil.tasks.readings import strongest
from sceann_hil.tasks.starts import Starts
from sceann_hil.tasks.wheels import DrivingTask, wheel_speed


class AvoidanceConfig(DrivingTask):
    """Drive fast and straight, away from walls and obstacles (Floreano and Mondada 1994)."""

    type: Literal["avoidance"] = "avoidance"
    starts: Starts = ((0.15, 0.15, 45.0), (0.85, 0.15, 180.0), (0.85, 0.85, 225.0), (0.15, 0.85, 0.0))
    """One trial for each: x and y in metres, heading in degrees."""
    success: float = 0.3
    """A trial that is worth more than this counts as a success."""
    distance_sensors: SensorNumbers = ()
    """Numbers of the sensors that see walls; all of them if none is given."""
    backwards_counts: bool = False
    """Driving backwards is worth as much as forwards, as in the paper; there it lets a robot go to and fro."""

    def sensors_needed(self) -> dict[str, tuple[int, ...]]:
        return {"distance_sensors": self.distance_sensors}

    def value(self) -> StepValue:
        nearest, backwards_counts = strongest(self.distance_sensors), self.backwards_counts
        speed_of = wheel_speed(self.forwards_only)

        def avoidance(sensors: Floats, motors: Floats) -> float:
            left, right = speed_of(motors[0]), speed_of(motors[1])
            speed = 0.5 * (abs(left) + abs(right)) if backwards_counts else max(0.5 * (left + right), 0.0)
            return float(speed * (1.0 - sqrt(0.5 * abs(left - right))) * (1.0 - nearest(sensors)))

        return step_value(avoidance)

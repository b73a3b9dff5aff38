"""Line following, the first task of many courses: along a dark line, fast.

A step is worth the speed forwards times how dark it is under the ground sensors: the darkest of them counts, so that a
robot with a sensor on either side of the line may keep the line between them.
"""

from __future__ import annotations

from typing import Literal

from sceann_hil.robot.step_value import Floats, StepValue, step_value
from sceann_hil.tasks.on_a_plane import SensorNumbers
from sceann_hil.tasks.readings import weakest
from sceann_hil.tasks.starts import Starts
from sceann_hil.tasks.wheels import DrivingTask, wheel_speed


class LineFollowingConfig(DrivingTask):
    """Drive along a dark line: a step is worth the speed forwards times how dark it is under the ground sensors."""

    type: Literal["line_following"] = "line_following"
    starts: Starts = ((0.3, 0.2, 0.0), (0.8, 0.5, 90.0), (0.7, 0.8, 180.0), (0.2, 0.5, 270.0))
    """One trial for each: x and y in metres, heading in degrees."""
    success: float = 0.4
    """A trial that is worth more than this counts as a success."""
    ground_sensors: SensorNumbers = ()
    """Numbers of the ground sensors, which read 0 over the line; all sensors if none is given."""

    def sensors_needed(self) -> dict[str, tuple[int, ...]]:
        return {"ground_sensors": self.ground_sensors}

    def value(self) -> StepValue:
        darkest, speed_of = weakest(self.ground_sensors), wheel_speed(self.forwards_only)

        def on_line(sensors: Floats, motors: Floats) -> float:
            speed = 0.5 * (speed_of(motors[0]) + speed_of(motors[1]))
            return float(max(speed, 0.0) * (1.0 - darkest(sensors)))

        return step_value(on_line)

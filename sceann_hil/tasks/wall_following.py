"""Wall following: along a wall at a distance at which a sensor at the side reads a given value. Our formulation.

A step is worth the speed forwards times how well the side's sensor keeps its value, ``1 - |reading - keep| / keep`` and
not below 0, times how free it is in front.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sceann_hil.robot.step_value import Floats, StepValue, step_value
from sceann_hil.tasks.on_a_plane import SensorNumbers
from sceann_hil.tasks.readings import strongest
from sceann_hil.tasks.starts import Starts
from sceann_hil.tasks.wheels import DrivingTask, wheel_speed


class WallFollowingConfig(DrivingTask):
    """Drive along a wall: speed times how well a side's sensor keeps its reading, times how free the front is."""

    type: Literal["wall_following"] = "wall_following"
    starts: Starts = ((0.3, 0.08, 0.0), (0.92, 0.3, 90.0), (0.7, 0.92, 180.0), (0.08, 0.7, 270.0))
    """One trial for each: x and y in metres, heading in degrees."""
    success: float = 0.3
    """A trial that is worth more than this counts as a success."""
    side_sensor: Annotated[int, Field(ge=0, le=63)] = 0
    """Number of the sensor that looks at the wall."""
    front_sensors: SensorNumbers = ()
    """Numbers of the sensors that should see nothing."""
    keep: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.5
    """What the side's sensor should read."""

    def sensors_needed(self) -> dict[str, tuple[int, ...]]:
        return {"side_sensor": (self.side_sensor,), "front_sensors": self.front_sensors}

    def value(self) -> StepValue:
        side, keep = self.side_sensor, self.keep
        blocked = strongest(self.front_sensors or (side,))
        looks_ahead = bool(self.front_sensors)
        speed_of = wheel_speed(self.forwards_only)

        def along_wall(sensors: Floats, motors: Floats) -> float:
            kept = max(1.0 - abs(sensors[side] - keep) / keep, 0.0)
            free = 1.0 - blocked(sensors) if looks_ahead else 1.0
            speed = 0.5 * (speed_of(motors[0]) + speed_of(motors[1]))
            return float(max(speed, 0.0) * kept * free)

        return step_value(along_wall)

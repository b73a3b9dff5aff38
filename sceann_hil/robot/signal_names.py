"""What people call a body's sensors and motors: the same in the viewer, in reports and in comparisons."""

from __future__ import annotations

from sceann_hil.network.coding import NetworkSize
from sceann_hil.robot.drawing import Drawing


def sensor_names(size: NetworkSize, drawing: Drawing | None) -> tuple[str, ...]:
    """Of the sensors, in the controller's order: what they are where the drawing says it, else s1, s2, ..."""
    names = drawing.sensor_names if drawing is not None else ()
    return names[: size.n_sensors] if len(names) >= size.n_sensors else size.sensor_names


def motor_names(size: NetworkSize, drawing: Drawing | None) -> tuple[str, ...]:
    """Of the motor neurons: what they move where the drawing says it, else m1, m2, ..."""
    names = drawing.motor_names if drawing is not None else ()
    return names if len(names) == size.n_motors else size.motor_names


def sensors_from_left(size: NetworkSize, drawing: Drawing | None) -> tuple[int, ...]:
    """The sensors in the order in which pictures list them: as the robot has them, from its left to its right.

    Sensors of different kinds stay apart: a kind ends where the directions go back to the right. Sensors whose place
    nobody knows come last, in the controller's order.
    """
    fans = [fan for part in drawing.parts for fan in part.fans][: size.n_sensors] if drawing is not None else []
    sides = [fan.direction_rad if fan.half_width_rad > 0.0 else fan.at_m[1] for fan in fans]
    kinds: list[list[int]] = []
    for sensor, side in enumerate(sides):
        if kinds and side >= sides[kinds[-1][-1]]:
            kinds[-1].append(sensor)
        else:
            kinds.append([sensor])
    ordered = [sensor for kind in kinds for sensor in sorted(kind, key=lambda sensor: -sides[sensor])]
    return (*ordered, *range(len(fans), size.n_sensors))

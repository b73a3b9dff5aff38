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

"""What people call a body's sensors and motors: the same in the viewer, in reports and in comparisons."""

from __future__ import annotations

import math

from sceann_hil.network.coding import NetworkSize
from sceann_hil.robot.scenery import ArenaScenery, CartPoleScenery, Scenery


def sensor_names(size: NetworkSize, scenery: Scenery | None) -> tuple[str, ...]:
    """Of the sensors, in the controller's order: what they are where the scenery says it, else s1, s2, ..."""
    n = size.n_sensors
    match scenery:
        case ArenaScenery(sensor_directions_rad=directions) if len(directions) == n:
            return tuple(f"{math.degrees(a):+.0f}°" if abs(a) > 1e-9 else "0°" for a in directions)
        case CartPoleScenery() if n <= 4:
            return ("x", "angle", "speed", "rate")[:n]
    return size.sensor_names


def motor_names(size: NetworkSize, scenery: Scenery | None) -> tuple[str, ...]:
    """Of the motor neurons: what they move where the scenery says it, else m1, m2, ..."""
    n = size.n_motors
    match scenery:
        case ArenaScenery() if n == 2:
            return ("left", "right")
        case CartPoleScenery() if n == 1:
            return ("force",)
    return size.motor_names

"""What a Thymio II looks like, seen from the middle of its axle with its nose along x; metres and radians.

Source: the makers' simulator, ``enki/robots/thymio2/Thymio2.cpp``.
"""

from __future__ import annotations

import numpy as np

WHEEL_INTERVAL_M = 0.094
RADIUS_M = 0.08
"""From the axle to the nose; the twin is round, the robot is not, behind its axle there are only 3 cm of it."""
RANGE_M = 0.14
"""How far the infrared sensors see."""
RAY_ANGLES_RAD: tuple[float, ...] = tuple(np.deg2rad([-15.0, 0.0, 15.0]).tolist())
"""Rays of an infrared sensor, from where it looks."""
INFRARED: tuple[tuple[tuple[float, float], float], ...] = (
    ((0.062, 0.0485), 0.69813),
    ((0.075, 0.0255), 0.34906),
    ((0.0795, 0.0), 0.0),
    ((0.075, -0.0255), -0.34906),
    ((0.062, -0.0485), -0.69813),
    ((-0.0295, 0.0295), float(np.pi)),
    ((-0.0295, -0.0295), float(np.pi)),
)
"""Where each sensor is and where it looks, in the order of ``prox.horizontal``."""
GROUND: tuple[tuple[float, float], ...] = ((0.072, 0.0115), (0.072, -0.0115))
"""Where each ground sensor is, in the order of ``prox.ground.delta``."""

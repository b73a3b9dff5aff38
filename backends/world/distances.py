"""How far points are from obstacles, for many places at once: plain geometry in float64, before anything runs."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def to_round(dx: Any, dy: Any, radius_m: float) -> Floats:
    """From the edge of a round obstacle to points at (dx, dy) from its centre; negative inside."""
    return np.asarray(np.hypot(dx, dy) - radius_m)


def to_box(dx: Any, dy: Any, size_m: tuple[float, float], angle_rad: Any) -> Floats:
    """From the edge of a rectangle, turned by an angle, to points at (dx, dy) from its centre; negative inside."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    out_x, out_y = np.abs(c * dx + s * dy) - size_m[0] / 2.0, np.abs(c * dy - s * dx) - size_m[1] / 2.0
    outside = np.hypot(np.maximum(out_x, 0.0), np.maximum(out_y, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(out_x, out_y), 0.0))

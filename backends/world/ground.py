"""How dark the floor is: a line, or rows of shades, on a grid of square cells."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

CELLS_PER_M = 200.0
"""Of a drawn line: cells of 5 mm, finer than a ground sensor's spot."""


def line_shades(
    arena_m: tuple[float, float], points_m: Sequence[tuple[float, float]], width_m: float, *, closed: bool
) -> NDArray[np.float32]:
    """A black line on a white floor, its edge one cell wide.

    Args:
        arena_m: width and height.
        points_m: corners of the line, at least 2.
        width_m: of the line.
        closed: the last corner is joined to the first.

    Returns:
        0 white to 1 black, shape ``(rows, columns)``, from the lower left corner.
    """
    columns, rows = (max(2, int(np.ceil(length * CELLS_PER_M))) for length in arena_m)
    x, y = (np.arange(columns) + 0.5) / CELLS_PER_M, (np.arange(rows) + 0.5) / CELLS_PER_M
    away = np.full((rows, columns), np.inf)
    corners = [*points_m, points_m[0]] if closed else list(points_m)
    for (ax, ay), (bx, by) in pairwise(corners):
        ex, ey = bx - ax, by - ay
        length2 = max(ex * ex + ey * ey, 1e-12)
        part = np.clip(((x - ax) * ex + (y[:, None] - ay) * ey) / length2, 0.0, 1.0)
        away = np.minimum(away, np.hypot(x - ax - part * ex, y[:, None] - ay - part * ey))
    return np.clip((width_m / 2.0 - away) * CELLS_PER_M + 0.5, 0.0, 1.0).astype(np.float32)


def map_shades(rows: Sequence[Sequence[float]]) -> NDArray[np.float32]:
    """Rows of shades as one reads them, the upper one first, as a grid from the lower left corner.

    Args:
        rows: 0 white to 1 black; all of the same length.
    """
    return np.array(rows[::-1], np.float32)

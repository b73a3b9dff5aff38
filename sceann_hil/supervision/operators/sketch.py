"""Where the robot has to stand before a trial, in characters that every terminal has."""

from __future__ import annotations

import math
from collections.abc import Mapping

from sceann_hil.robot.scenery import ArenaScenery, Scenery

COLUMNS = 36
"""Characters across the arena; a character is twice as high as it is wide."""
_HEADINGS = ("right", "up and right", "up", "up and left", "left", "down and left", "down", "down and right")


def sketch(scenery: Scenery | None, start: Mapping[str, float]) -> str:
    """The arena with its goal (G) and the robot (R) where it has to stand; empty where there is nothing to draw.

    Args:
        scenery: of the robot.
        start: start values by name.
    """
    if not isinstance(scenery, ArenaScenery) or not {"x_m", "y_m", "heading_rad"} <= start.keys():
        return ""
    width, height = scenery.arena_m
    rows = max(3, round(COLUMNS * height / width / 2))
    cells = [[" "] * COLUMNS for _ in range(rows)]

    def mark(x_m: float, y_m: float, text: str) -> None:
        column = min(COLUMNS - 1, max(0, int(x_m / width * COLUMNS)))
        row = min(rows - 1, max(0, int((1.0 - y_m / height) * rows)))
        cells[row][column] = text

    heading = start["heading_rad"]
    reach = 0.12 * width
    mark(*scenery.target_m, "G")
    for part in (1.0, 0.5):
        at = (start["x_m"] + part * reach * math.cos(heading), start["y_m"] + part * reach * math.sin(heading))
        mark(*at, "*" if part == 1.0 else ".")
    mark(start["x_m"], start["y_m"], "R")
    frame = f"+{'-' * COLUMNS}+"
    eighth = round(heading / (math.pi / 4)) % 8
    told = f"R: the robot, facing {_HEADINGS[eighth]} (to the *); G: the goal"
    return "\n".join([frame, *(f"|{''.join(row)}|" for row in cells), frame, told])

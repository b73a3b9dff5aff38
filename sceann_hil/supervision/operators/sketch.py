"""Where the robot has to stand before a trial, in characters that every terminal has."""

from __future__ import annotations

import math
from collections.abc import Mapping

from sceann_hil.robot.drawing import Block, Disc, Drawing, Look

COLUMNS, MOST_ROWS = 36, 14
_MARKS = {Look.TARGET: ("G", "the goal"), Look.LAMP: ("L", "a lamp"), Look.OBSTACLE: ("#", "an obstacle")}
_HEADINGS = ("right", "up and right", "up", "up and left", "left", "down and left", "down", "down and right")


def sketch(drawing: Drawing | None, start: Mapping[str, float]) -> str:
    """What stands still, and the robot (R) where it has to stand, seen from above.

    Args:
        drawing: of the robot.
        start: start values by name.

    Returns:
        Lines of text; empty where there is nothing to draw, or where the start does not say where the robot is.
    """
    part = drawing.parts[0] if drawing is not None and drawing.parts else None
    if drawing is None or part is None or not {part.x, part.y, part.turn} <= set(start):
        return ""
    left, right, bottom, top = drawing.bounds_m
    rows = max(3, min(MOST_ROWS, round(COLUMNS * (top - bottom) / (right - left) / 2)))
    cells = [[" "] * COLUMNS for _ in range(rows)]

    def mark(x_m: float, y_m: float, text: str) -> None:
        column = math.floor((x_m - left) / (right - left) * COLUMNS)
        row = math.floor((top - y_m) / (top - bottom) * rows)
        cells[min(rows - 1, max(0, row))][min(COLUMNS - 1, max(0, column))] = text

    told = []
    for shape in drawing.fixed:
        if isinstance(shape, Disc | Block) and shape.look in _MARKS:
            letter, meaning = _MARKS[shape.look]
            mark(*shape.at_m, letter)
            told += [f"{letter}: {meaning}"]
    x_m, y_m, heading_rad = (start[field] for field in (part.x, part.y, part.turn) if field is not None)
    for reach, text in ((0.12, "*"), (0.06, ".")):
        length = reach * (right - left)
        mark(x_m + length * math.cos(heading_rad), y_m + length * math.sin(heading_rad), text)
    mark(x_m, y_m, "R")
    heading = _HEADINGS[round(heading_rad / (math.pi / 4)) % 8]
    frame = f"+{'-' * COLUMNS}+"
    legend = "; ".join(dict.fromkeys([f"R: the robot, facing {heading} (to the *)", *told]))
    return "\n".join([frame, *(f"|{''.join(row)}|" for row in cells), frame, legend])

"""A robot's drawing in characters, for terminals: outlines of small dots, eight to a character (braille).

Where a terminal cannot show braille, a character with any dot in it becomes a sign of the shape that it belongs to.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sceann_hil.robot.drawing import Block, Disc, Drawing, Look, Part, Shades, Shape, Strip

_WIDE, _HIGH = 2, 4
"""Dots in a character."""
_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], np.uint8)
"""The dots of a braille character, from the top left."""
_BRAILLE = 0x2800
_SIGNS = {Look.TARGET: "G", Look.LAMP: "L", Look.OBSTACLE: "#", Look.WALL: "#", Look.BODY: "o", Look.TIP: "O"}
_SIGN = "."
_DARK = 0.5
"""Cells of a floor that are darker than this get dots."""
_CORNERS = 17
"""Of a circle."""

Points = NDArray[np.float64]
"""Of shape ``(n, 2)``, metres."""


@dataclass(frozen=True, slots=True)
class Cell:
    """A character, and what it is a piece of; None for a path, and where there is nothing."""

    text: str
    look: Look | None = None


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a part is and how it is turned, counter-clockwise."""

    x_m: float = 0.0
    y_m: float = 0.0
    angle_rad: float = 0.0

    def places(self, points: Points) -> Points:
        """Points of the part in the picture."""
        cos, sin = np.cos(self.angle_rad), np.sin(self.angle_rad)
        return np.asarray(points @ np.array([[cos, sin], [-sin, cos]]) + np.array([self.x_m, self.y_m]))


def pose_of(drawing: Drawing, part: Part, fields: Mapping[str, float]) -> Pose:
    """Where a part is, and what it is fixed to.

    Args:
        drawing: that it belongs to.
        part: which one.
        fields: the body's state by the names of its fields.

    Raises:
        KeyError: a field that the drawing follows is missing.
    """
    turn = fields[part.turn] if part.turn is not None else 0.0
    own = Pose(
        fields[part.x] if part.x is not None else 0.0,
        fields[part.y] if part.y is not None else 0.0,
        -turn if part.clockwise else turn,
    )
    if part.on is None:
        return own
    below = pose_of(drawing, next(other for other in drawing.parts if other.name == part.on), fields)
    (x_m, y_m), *_ = below.places(np.array([[own.x_m, own.y_m]]))
    return Pose(float(x_m), float(y_m), below.angle_rad + own.angle_rad)


class Raster:
    """What a drawing shows, as dots.

    Args:
        drawing: of the robot; everything that stands still is drawn at once.
        columns, rows: characters that there is room for; as many are used as keep the proportions.

    Attributes:
        columns, rows: characters that are used.
    """

    def __init__(self, drawing: Drawing, columns: int, rows: int) -> None:
        self.drawing = drawing
        left, right, bottom, top = drawing.bounds_m
        dots_per_m = min(_WIDE * columns / (right - left), _HIGH * rows / (top - bottom))
        self.columns = max(1, min(columns, round((right - left) * dots_per_m / _WIDE)))
        self.rows = max(1, min(rows, round((top - bottom) * dots_per_m / _HIGH)))
        self._dots_per_m = dots_per_m
        self._dots = np.zeros((self.rows * _HIGH, self.columns * _WIDE), np.bool_)
        self._looks: list[list[Look | None]] = [[None] * self.columns for _ in range(self.rows)]
        for shape in drawing.fixed:
            self._shape(shape, Pose())

    def path(self, points: Points) -> None:
        """Where something has been: points of shape ``(n, 2)``."""
        self._line(points, None)

    def parts(self, fields: Mapping[str, float]) -> None:
        """Everything that moves, where a state has it.

        Raises:
            KeyError: a field that the drawing follows is missing.
        """
        for part in self.drawing.parts:
            pose = pose_of(self.drawing, part, fields)
            for shape in part.shapes:
                self._shape(shape, pose)

    def lines(self, *, braille: bool = True) -> list[list[Cell]]:
        """The picture from the top, a list of characters for each line."""
        blocks = self._dots.reshape(self.rows, _HIGH, self.columns, _WIDE).transpose(0, 2, 1, 3)
        signs = (blocks * _BITS).sum(axis=(2, 3))
        picture = []
        for looks, codes in zip(self._looks, signs.tolist(), strict=True):
            cells = []
            for look, code in zip(looks, codes, strict=True):
                sign = chr(_BRAILLE + code) if braille else _SIGNS.get(look, _SIGN) if look is not None else _SIGN
                cells.append(Cell(sign, look) if code else Cell(" "))
            picture.append(cells)
        return picture

    def _shape(self, shape: Shape, pose: Pose) -> None:
        if isinstance(shape, Shades):
            self._shades(shape)
        elif isinstance(shape, Disc):
            turn = np.linspace(0.0, 2.0 * np.pi, _CORNERS)
            ring = shape.radius_m * np.column_stack([np.cos(turn), np.sin(turn)]) + np.array(shape.at_m)
            self._line(pose.places(ring), shape.look)
        elif isinstance(shape, Block):
            width, height = shape.size_m
            signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
            corners = Pose(*shape.at_m, shape.angle_rad).places(signs * np.array([width, height]) / 2)
            self._line(pose.places(corners), shape.look)
        else:
            self._line(pose.places(_as_points(shape)), shape.look)

    def _shades(self, shades: Shades) -> None:
        rows = np.array(shades.rows)
        height, width = (size / n for size, n in zip(shades.size_m[::-1], rows.shape, strict=True))
        for row, column in np.argwhere(rows > _DARK).tolist():
            y_m = (row + 0.5) * height
            self._line(np.array([[(column + 0.25) * width, y_m], [(column + 0.75) * width, y_m]]), Look.LINE)

    def _line(self, points: Points, look: Look | None) -> None:
        """A line with corners, one dot wide; what lies outside is cut off."""
        left, _, _, top = self.drawing.bounds_m
        at = np.column_stack([points[:, 0] - left, top - points[:, 1]]) * self._dots_per_m
        dots = [at[:1]]
        for first, last in pairwise(at):
            n = 1 + int(2.0 * float(np.abs(last - first).max()))
            dots.append(first + (last - first) * np.linspace(0.0, 1.0, n + 1)[1:, None])
        x, y = np.floor(np.concatenate(dots)).astype(np.int64).T
        inside = (x >= 0) & (y >= 0) & (x < self._dots.shape[1]) & (y < self._dots.shape[0])
        self._dots[y[inside], x[inside]] = True
        for row, column in set(zip((y[inside] // _HIGH).tolist(), (x[inside] // _WIDE).tolist(), strict=True)):
            self._looks[row][column] = look


def _as_points(strip: Strip) -> Points:
    return np.array(strip.points_m, np.float64).reshape(-1, 2)

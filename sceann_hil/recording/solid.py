"""A drawing that is seen from above, in three dimensions: walls and obstacles stand up, the robot is a low cylinder.

It lives in subtrees of its own, because a view shows either 2D or 3D primitives.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from sceann_hil.recording import style
from sceann_hil.recording.columns import static
from sceann_hil.recording.scene import SCENE, entity
from sceann_hil.robot.drawing import Block, Disc, Drawing, Look, Shape, Strip

SOLID = f"{SCENE}/solid"
_TALL = {Look.WALL, Look.OBSTACLE}


def solid(drawing: Drawing) -> Iterator[Chunk]:
    """The same things as in two dimensions; nothing for a drawing that is seen from the side."""
    if not drawing.from_above:
        return
    left, right, bottom, top = drawing.bounds_m
    tall = max(right - left, top - bottom) / 16
    floor = rr.Boxes3D(
        centers=[[(left + right) / 2, (bottom + top) / 2, -0.003]],
        half_sizes=[[(right - left) / 2, (top - bottom) / 2, 0.002]],
        colors=style.colours(style.FLOOR),
        fill_mode="solid",
    )
    yield static(f"{SOLID}/floor", floor)
    for number, shape in enumerate(drawing.fixed):
        height = tall if _look(shape) in _TALL else tall / 12
        yield from _solid_shape(f"{SOLID}/shape{number}", shape, 0.0, height)
    for part in drawing.parts:
        height = 0.0
        for number, shape in enumerate(part.shapes):
            low = height if _look(shape) is Look.NOSE else 0.0
            height = max(height, tall * 0.7)
            high = height * (1.1 if _look(shape) is Look.NOSE else 1.0)
            yield from _solid_shape(f"{entity(drawing, part)}/solid/shape{number}", shape, low, high)


def _look(shape: Shape) -> Look | None:
    return getattr(shape, "look", None)


def _solid_shape(name: str, shape: Shape, low: float, high: float) -> Iterator[Chunk]:
    middle, height = (low + high) / 2, high - low
    if isinstance(shape, Disc):
        yield static(
            name,
            rr.Cylinders3D(
                centers=[[*shape.at_m, middle]],
                lengths=[height],
                radii=[shape.radius_m],
                colors=style.look_colour(shape.look),
                fill_mode="solid",
            ),
        )
    elif isinstance(shape, Strip):
        boxes = [_along(a, b, shape.width_m) for a, b in pairwise(shape.points_m)]
        yield _boxes(name, boxes, middle, height, shape.look)
    elif isinstance(shape, Block):
        yield _boxes(name, [(shape.at_m, shape.size_m, shape.angle_rad)], middle, height, shape.look)


_Box = tuple[tuple[float, float], tuple[float, float], float]


def _along(a: tuple[float, float], b: tuple[float, float], width_m: float) -> _Box:
    way = complex(*b) - complex(*a)
    centre = (complex(*a) + complex(*b)) / 2
    return (centre.real, centre.imag), (abs(way) + width_m, width_m), float(np.angle(way))


def _boxes(name: str, boxes: list[_Box], middle: float, height: float, look: Look) -> Chunk:
    return static(
        name,
        rr.Boxes3D(
            centers=[[*centre, middle] for centre, _, _ in boxes],
            half_sizes=[[size[0] / 2, size[1] / 2, height / 2] for _, size, _ in boxes],
            rotation_axis_angles=[rr.RotationAxisAngle(axis=[0, 0, 1], angle=angle) for _, _, angle in boxes],
            colors=style.look_colour(look),
            fill_mode="solid",
        ),
    )

"""How far a line goes before it meets something: plain geometry over lanes, in float32.

A ray begins at (``work[OX], work[OY]``) and runs along the unit vector (``work[DX], work[DY]``); ``work[NEAR]`` holds
the distance to the nearest thing met so far. Inside an obstacle the distance is 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from backends.world.layout import (
    AT_BOXES,
    AT_ROUND,
    AT_WALLS,
    BOX_ROW,
    HEIGHT,
    N_BOXES,
    N_ROUND,
    N_WALLS,
    ROUND_ROW,
    WALL_ROW,
    WIDTH,
)
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES

_F = np.float32
COS, SIN, OX, OY, DX, DY, NEAR = range(7)
_TINY = _F(1e-9)
_FAR = _F(1e9)

Float32Array = NDArray[np.float32]


@compiled_part
def aim(
    state: Float32Array, work: Float32Array, px: np.float32, py: np.float32, qx: np.float32, qy: np.float32
) -> None:
    """Put every lane's ray where the robot's body has it: at p, along q."""
    for lane in range(LANES):
        c, s = work[COS, lane], work[SIN, lane]
        work[OX, lane] = state[0, lane] + c * px - s * py
        work[OY, lane] = state[1, lane] + s * px + c * py
        work[DX, lane] = c * qx - s * qy
        work[DY, lane] = s * qx + c * qy


@compiled_part
def meet_arena(work: Float32Array, parameters: Float32Array) -> None:
    """The four walls, seen from inside."""
    width, height = parameters[WIDTH], parameters[HEIGHT]
    for lane in range(LANES):
        dx, dy = work[DX, lane], work[DY, lane]
        # first of all: a ray along a wall must look for the wall on the side that its substitute points to
        dx = dx if abs(dx) > _TINY else _TINY
        dy = dy if abs(dy) > _TINY else _TINY
        ahead_x = (width if dx > _F(0.0) else _F(0.0)) - work[OX, lane]
        ahead_y = (height if dy > _F(0.0) else _F(0.0)) - work[OY, lane]
        # one division for both directions
        inverse = _F(1.0) / (dx * dy)
        nearest = min(ahead_x * dy * inverse, ahead_y * dx * inverse)
        work[NEAR, lane] = min(work[NEAR, lane], max(nearest, _F(0.0)))


@compiled_part
def meet_things(work: Float32Array, parameters: Float32Array) -> None:
    """Obstacles and inner walls."""
    for k in range(np.int64(parameters[N_ROUND])):
        row = np.int64(parameters[AT_ROUND]) + ROUND_ROW * k
        _meet_round(work, parameters[row], parameters[row + 1], parameters[row + 2])
    for k in range(np.int64(parameters[N_BOXES])):
        row = np.int64(parameters[AT_BOXES]) + BOX_ROW * k
        _meet_box(
            work,
            parameters[row],
            parameters[row + 1],
            parameters[row + 2],
            parameters[row + 3],
            parameters[row + 4],
            parameters[row + 5],
        )
    for k in range(np.int64(parameters[N_WALLS])):
        row = np.int64(parameters[AT_WALLS]) + WALL_ROW * k
        _meet_wall(work, parameters[row], parameters[row + 1], parameters[row + 2], parameters[row + 3])


@compiled_part
def _meet_round(work: Float32Array, x: np.float32, y: np.float32, radius: np.float32) -> None:
    for lane in range(LANES):
        to_x, to_y = x - work[OX, lane], y - work[OY, lane]
        along = to_x * work[DX, lane] + to_y * work[DY, lane]
        away2 = to_x * to_x + to_y * to_y
        inside = away2 <= radius * radius
        rest = radius * radius - (away2 - along * along)
        t = along - np.sqrt(max(rest, _F(0.0)))
        met = rest >= _F(0.0) and t >= _F(0.0)
        t = t if met else _FAR
        t = _F(0.0) if inside else t
        work[NEAR, lane] = min(work[NEAR, lane], t)


@compiled_part
def _meet_box(
    work: Float32Array,
    x: np.float32,
    y: np.float32,
    c: np.float32,
    s: np.float32,
    half_x: np.float32,
    half_y: np.float32,
) -> None:
    for lane in range(LANES):
        # in the box's own frame, where its sides are lines of constant x or y
        rx, ry = work[OX, lane] - x, work[OY, lane] - y
        ox, oy = c * rx + s * ry, c * ry - s * rx
        dx = c * work[DX, lane] + s * work[DY, lane]
        dy = c * work[DY, lane] - s * work[DX, lane]
        dx = dx if abs(dx) > _TINY else _TINY
        dy = dy if abs(dy) > _TINY else _TINY
        inverse = _F(1.0) / (dx * dy)
        ix, iy = dy * inverse, dx * inverse
        ax, bx = (-half_x - ox) * ix, (half_x - ox) * ix
        ay, by = (-half_y - oy) * iy, (half_y - oy) * iy
        enters = max(min(ax, bx), min(ay, by))
        leaves = min(max(ax, bx), max(ay, by))
        met = enters <= leaves and leaves >= _F(0.0)
        t = max(enters, _F(0.0)) if met else _FAR
        work[NEAR, lane] = min(work[NEAR, lane], t)


@compiled_part
def _meet_wall(work: Float32Array, x: np.float32, y: np.float32, ex: np.float32, ey: np.float32) -> None:
    for lane in range(LANES):
        rx, ry = x - work[OX, lane], y - work[OY, lane]
        dx, dy = work[DX, lane], work[DY, lane]
        across = dx * ey - dy * ex
        parallel = abs(across) <= _TINY
        inverse = _F(1.0) / (_F(1.0) if parallel else across)
        t = (rx * ey - ry * ex) * inverse
        part = (rx * dy - ry * dx) * inverse
        met = (not parallel) and t >= _F(0.0) and part >= _F(0.0) and part <= _F(1.0)
        work[NEAR, lane] = min(work[NEAR, lane], t if met else _FAR)

"""How far a line goes before it meets something: plain geometry over lanes, in float32.

Scratch memory is one flat row of numbers here, with room for `LANES` numbers of each kind: compilers then see that no
kind overlaps another. A ray begins at (`OX`, `OY`) and runs along the unit vector (`DX`, `DY`); `NEAR` holds the
distance to the nearest thing met so far. Inside an obstacle the distance is 0.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from backends.simulation.maths import cosine, sine
from backends.world.layout import (
    AT_BOXES,
    AT_DRAWN_BOXES,
    AT_DRAWN_ROUND,
    AT_ROUND,
    AT_WALLS,
    BOX_ROW,
    DRAWN_BOX_ROW,
    DRAWN_BOX_STATE,
    DRAWN_ROUND_STATE,
    FIRST_DRAWN,
    HEIGHT,
    N_BOXES,
    N_DRAWN_BOXES,
    N_DRAWN_ROUND,
    N_ROUND,
    N_WALLS,
    ROUND_ROW,
    WALL_ROW,
    WIDTH,
)
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES

_F = np.float32
COS, SIN, X, Y, OX, OY, DX, DY, NEAR, SPARE = (LANES * kind for kind in range(10))
"""Where each kind begins: the heading's cosine and sine, the body's place, the ray; from SPARE on, other things."""
_TINY = _F(1e-9)
_FAR = _F(1e9)

Float32Array = NDArray[np.float32]


@compiled_part
def take_pose(state: Float32Array, w: Float32Array) -> None:
    """Where every lane's body is and looks; before any ray."""
    for lane in range(LANES):
        w[COS + lane], w[SIN + lane] = cosine(state[2, lane]), sine(state[2, lane])
        w[X + lane], w[Y + lane] = state[0, lane], state[1, lane]


@compiled_part
def aim(w: Float32Array, px: np.float32, py: np.float32, qx: np.float32, qy: np.float32) -> None:
    """Put every lane's ray where the robot's body has it: at p, along q."""
    for lane in range(LANES):
        c, s = w[COS + lane], w[SIN + lane]
        w[OX + lane] = w[X + lane] + c * px - s * py
        w[OY + lane] = w[Y + lane] + s * px + c * py
        w[DX + lane] = c * qx - s * qy
        w[DY + lane] = s * qx + c * qy


@compiled_part
def meet_arena(w: Float32Array, parameters: Float32Array, reach: np.float32) -> None:
    """The four walls, seen from inside, or nothing as far as the ray reaches."""
    width, height = parameters[WIDTH], parameters[HEIGHT]
    for lane in range(LANES):
        dx, dy = w[DX + lane], w[DY + lane]
        # first of all: a ray along a wall must look for the wall on the side that its substitute points to
        dx = dx if abs(dx) > _TINY else _TINY
        dy = dy if abs(dy) > _TINY else _TINY
        ahead_x = (width if dx > _F(0.0) else _F(0.0)) - w[OX + lane]
        ahead_y = (height if dy > _F(0.0) else _F(0.0)) - w[OY + lane]
        # one division for both directions
        inverse = _F(1.0) / (dx * dy)
        nearest = min(ahead_x * dy * inverse, ahead_y * dx * inverse)
        w[NEAR + lane] = min(reach, max(nearest, _F(0.0)))


@compiled_part
def meet_things(state: Float32Array, w: Float32Array, parameters: Float32Array) -> None:
    """Obstacles, those that the state places too, and inner walls."""
    for k in range(np.int64(parameters[N_ROUND])):
        row = np.int64(parameters[AT_ROUND]) + ROUND_ROW * k
        x, y, radius = parameters[row], parameters[row + 1], parameters[row + 2]
        for lane in range(LANES):
            w[NEAR + lane] = min(w[NEAR + lane], _to_round(w, lane, x, y, radius))
    for k in range(np.int64(parameters[N_BOXES])):
        row = np.int64(parameters[AT_BOXES]) + BOX_ROW * k
        x, y, c, s = parameters[row], parameters[row + 1], parameters[row + 2], parameters[row + 3]
        half_x, half_y = parameters[row + 4], parameters[row + 5]
        for lane in range(LANES):
            w[NEAR + lane] = min(w[NEAR + lane], _to_box(w, lane, x, y, c, s, half_x, half_y))
    for k in range(np.int64(parameters[N_WALLS])):
        row = np.int64(parameters[AT_WALLS]) + WALL_ROW * k
        x, y, ex, ey = parameters[row], parameters[row + 1], parameters[row + 2], parameters[row + 3]
        for lane in range(LANES):
            w[NEAR + lane] = min(w[NEAR + lane], _to_wall(w, lane, x, y, ex, ey))
    first = FIRST_DRAWN
    for k in range(np.int64(parameters[N_DRAWN_ROUND])):
        radius = parameters[np.int64(parameters[AT_DRAWN_ROUND]) + k]
        for lane in range(LANES):
            w[NEAR + lane] = min(w[NEAR + lane], _to_round(w, lane, state[first, lane], state[first + 1, lane], radius))
        first += DRAWN_ROUND_STATE
    for k in range(np.int64(parameters[N_DRAWN_BOXES])):
        row = np.int64(parameters[AT_DRAWN_BOXES]) + DRAWN_BOX_ROW * k
        half_x, half_y = parameters[row], parameters[row + 1]
        for lane in range(LANES):
            x, y, turn = state[first, lane], state[first + 1, lane], state[first + 2, lane]
            t = _to_box(w, lane, x, y, cosine(turn), sine(turn), half_x, half_y)
            w[NEAR + lane] = min(w[NEAR + lane], t)
        first += DRAWN_BOX_STATE


@compiled_part
def _to_round(w: Float32Array, lane: int, x: np.float32, y: np.float32, radius: np.float32) -> np.float32:
    to_x, to_y = x - w[OX + lane], y - w[OY + lane]
    along = to_x * w[DX + lane] + to_y * w[DY + lane]
    away2 = to_x * to_x + to_y * to_y
    inside = away2 <= radius * radius
    rest = radius * radius - (away2 - along * along)
    t = along - np.sqrt(max(rest, _F(0.0)))
    met = rest >= _F(0.0) and t >= _F(0.0)
    t = t if met else _FAR
    return _F(0.0) if inside else t


@compiled_part
def _to_box(
    w: Float32Array,
    lane: int,
    x: np.float32,
    y: np.float32,
    c: np.float32,
    s: np.float32,
    half_x: np.float32,
    half_y: np.float32,
) -> np.float32:
    # in the box's own frame, where its sides are lines of constant x or y
    rx, ry = w[OX + lane] - x, w[OY + lane] - y
    ox, oy = c * rx + s * ry, c * ry - s * rx
    dx = c * w[DX + lane] + s * w[DY + lane]
    dy = c * w[DY + lane] - s * w[DX + lane]
    dx = dx if abs(dx) > _TINY else _TINY
    dy = dy if abs(dy) > _TINY else _TINY
    inverse = _F(1.0) / (dx * dy)
    ix, iy = dy * inverse, dx * inverse
    ax, bx = (-half_x - ox) * ix, (half_x - ox) * ix
    ay, by = (-half_y - oy) * iy, (half_y - oy) * iy
    enters = max(min(ax, bx), min(ay, by))
    leaves = min(max(ax, bx), max(ay, by))
    met = enters <= leaves and leaves >= _F(0.0)
    return max(enters, _F(0.0)) if met else _FAR


@compiled_part
def _to_wall(w: Float32Array, lane: int, x: np.float32, y: np.float32, ex: np.float32, ey: np.float32) -> np.float32:
    rx, ry = x - w[OX + lane], y - w[OY + lane]
    dx, dy = w[DX + lane], w[DY + lane]
    across = dx * ey - dy * ex
    parallel = abs(across) <= _TINY
    inverse = _F(1.0) / (_F(1.0) if parallel else across)
    t = (rx * ey - ry * ex) * inverse
    part = (rx * dy - ry * dx) * inverse
    met = (not parallel) and t >= _F(0.0) and part >= _F(0.0) and part <= _F(1.0)
    return t if met else _FAR

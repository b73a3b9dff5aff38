"""How the robot's body moves in a world: its wheels, and what it cannot drive through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from backends.simulation.lanes import RUNNING
from backends.simulation.maths import cosine, sine, wrap_angle
from backends.world.layout import (
    AT_BOXES,
    AT_DRAWN_BOXES,
    AT_DRAWN_ROUND,
    AT_ROUND,
    AT_WALLS,
    BOX_ROW,
    BUMP_ENDS,
    DRAWN_BOX_ROW,
    DRAWN_BOX_STATE,
    DRAWN_ROUND_STATE,
    FIRST_DRAWN,
    GOAL_REACH,
    GOAL_X,
    GOAL_Y,
    HEIGHT,
    MOTOR_GAIN,
    MOTOR_REST,
    N_BOXES,
    N_DRAWN_BOXES,
    N_DRAWN_ROUND,
    N_ROUND,
    N_WALLS,
    NOISE,
    RADIUS,
    ROUND_ROW,
    STEP_M,
    WALL_ROW,
    WHEEL_INTERVAL,
    WIDTH,
)
from backends.world.rays import COS, SIN, SPARE, X, Y
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES
from sceann_hil.robot import EndReason

_F = np.float32
_GOAL, _OUT = int(EndReason.GOAL), int(EndReason.OUT_OF_BOUNDS)
_BUMPED = SPARE
"""Scratch memory: 1 where the body met something."""

Float32Array = NDArray[np.float32]


@compiled_part
def advance(
    state: Float32Array,
    motors: Float32Array,
    noise: Float32Array,
    end_reasons: NDArray[np.int32],
    work: Float32Array,
    parameters: Float32Array,
) -> None:
    """One step of all bodies, and whose trial ended with it."""
    w = work.ravel()
    radius, level, interval = parameters[RADIUS], parameters[NOISE], parameters[WHEEL_INTERVAL]
    speed, rest = parameters[STEP_M] * parameters[MOTOR_GAIN], parameters[MOTOR_REST]
    for lane in range(LANES):
        left = speed * (motors[0, lane] - rest)
        right = speed * (motors[1, lane] - rest)
        heading = state[2, lane]
        forward = _F(0.5) * (right + left)
        # the heading is still what the sensors took it for
        dx, dy = forward * w[COS + lane], forward * w[SIN + lane]
        turn = (right - left) / interval
        w[X + lane] = state[0, lane] + (dx + level * abs(dx) * noise[0, lane])
        w[Y + lane] = state[1, lane] + (dy + level * abs(dy) * noise[1, lane])
        state[2, lane] = wrap_angle(heading + turn + level * abs(turn) * noise[2, lane])
        w[_BUMPED + lane] = _F(0.0)
    _slide_along_things(state, w, parameters)
    for lane in range(LANES):
        x = min(max(w[X + lane], radius), parameters[WIDTH] - radius)
        y = min(max(w[Y + lane], radius), parameters[HEIGHT] - radius)
        bumped = w[_BUMPED + lane] > _F(0.0) or x != w[X + lane] or y != w[Y + lane]
        state[0, lane], state[1, lane] = x, y
        gx, gy = parameters[GOAL_X] - x, parameters[GOAL_Y] - y
        reach = parameters[GOAL_REACH]
        at_goal = reach >= _F(0.0) and gx * gx + gy * gy <= reach * reach
        out = bumped and parameters[BUMP_ENDS] > _F(0.0)
        end = np.int32(_OUT) if out else np.int32(RUNNING)
        end_reasons[lane] = np.int32(_GOAL) if at_goal else end


@compiled_part
def _slide_along_things(state: Float32Array, w: Float32Array, parameters: Float32Array) -> None:
    """Push the body out of whatever it entered, along the shortest way."""
    radius = parameters[RADIUS]
    for k in range(np.int64(parameters[N_ROUND])):
        row = np.int64(parameters[AT_ROUND]) + ROUND_ROW * k
        cx, cy, reach = parameters[row], parameters[row + 1], parameters[row + 2] + radius
        for lane in range(LANES):
            _push(w, lane, cx, cy, reach)
    for k in range(np.int64(parameters[N_BOXES])):
        row = np.int64(parameters[AT_BOXES]) + BOX_ROW * k
        cx, cy, c, s = parameters[row], parameters[row + 1], parameters[row + 2], parameters[row + 3]
        half_x, half_y = parameters[row + 4], parameters[row + 5]
        for lane in range(LANES):
            _push_from_box(w, lane, cx, cy, c, s, half_x, half_y, radius)
    for k in range(np.int64(parameters[N_WALLS])):
        row = np.int64(parameters[AT_WALLS]) + WALL_ROW * k
        ax, ay, ex, ey = parameters[row], parameters[row + 1], parameters[row + 2], parameters[row + 3]
        inverse = _F(1.0) / max(ex * ex + ey * ey, _F(1e-12))
        for lane in range(LANES):
            part = ((w[X + lane] - ax) * ex + (w[Y + lane] - ay) * ey) * inverse
            part = min(max(part, _F(0.0)), _F(1.0))
            _push(w, lane, ax + part * ex, ay + part * ey, radius)
    first = FIRST_DRAWN
    for k in range(np.int64(parameters[N_DRAWN_ROUND])):
        reach = parameters[np.int64(parameters[AT_DRAWN_ROUND]) + k] + radius
        for lane in range(LANES):
            _push(w, lane, state[first, lane], state[first + 1, lane], reach)
        first += DRAWN_ROUND_STATE
    for k in range(np.int64(parameters[N_DRAWN_BOXES])):
        row = np.int64(parameters[AT_DRAWN_BOXES]) + DRAWN_BOX_ROW * k
        half_x, half_y = parameters[row], parameters[row + 1]
        for lane in range(LANES):
            x, y, turn = state[first, lane], state[first + 1, lane], state[first + 2, lane]
            _push_from_box(w, lane, x, y, cosine(turn), sine(turn), half_x, half_y, radius)
        first += DRAWN_BOX_STATE


@compiled_part
def _push_from_box(
    w: Float32Array,
    lane: int,
    cx: np.float32,
    cy: np.float32,
    c: np.float32,
    s: np.float32,
    half_x: np.float32,
    half_y: np.float32,
    radius: np.float32,
) -> None:
    """Keep a lane's body outside of a rectangle."""
    rx, ry = w[X + lane] - cx, w[Y + lane] - cy
    x, y = c * rx + s * ry, c * ry - s * rx
    inside = abs(x) < half_x and abs(y) < half_y
    # the nearest point of the box; from inside, of its nearest side
    nx, ny = min(max(x, -half_x), half_x), min(max(y, -half_y), half_y)
    by_x = inside and half_x - abs(x) < half_y - abs(y)
    by_y = inside and not by_x
    side_x, side_y = (half_x if x >= _F(0.0) else -half_x), (half_y if y >= _F(0.0) else -half_y)
    nx, ny = (side_x if by_x else nx), (side_y if by_y else ny)
    away_x, away_y = x - nx, y - ny
    away = np.sqrt(away_x * away_x + away_y * away_y)
    hit = inside or away < radius
    scale = (radius if not inside else -radius) / max(away, _F(1e-6))
    mx, my = (nx + away_x * scale if hit else x), (ny + away_y * scale if hit else y)
    w[X + lane], w[Y + lane] = cx + c * mx - s * my, cy + s * mx + c * my
    bumped = w[_BUMPED + lane]
    w[_BUMPED + lane] = _F(1.0) if hit else bumped


@compiled_part
def _push(w: Float32Array, lane: int, x: np.float32, y: np.float32, reach: np.float32) -> None:
    """Keep a lane's body at least `reach` away from a point."""
    px, py, bumped = w[X + lane], w[Y + lane], w[_BUMPED + lane]
    dx, dy = px - x, py - y
    away = np.sqrt(dx * dx + dy * dy)
    hit = away < reach
    scale = reach / max(away, _F(1e-6))
    w[X + lane] = x + dx * scale if hit else px
    w[Y + lane] = y + dy * scale if hit else py
    w[_BUMPED + lane] = _F(1.0) if hit else bumped

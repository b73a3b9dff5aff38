"""A two-wheeled robot that sees what is there: walls, obstacles, shades of the floor, lamps and their shadows."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from backends.simulation.engine import SimulatedRobot
from backends.simulation.gap import Gap
from backends.simulation.lanes import RUNNING
from backends.simulation.maths import cosine, sine, wrap_angle
from backends.world.layout import (
    AT_BOXES,
    AT_GROUND,
    AT_LAMPS,
    AT_LIGHT,
    AT_RAYS,
    AT_RESPONSES,
    AT_ROUND,
    AT_SHADES,
    AT_WALLS,
    BOX_ROW,
    BUMP_ENDS,
    FIRST_GROUND,
    FIRST_LIGHT,
    GOAL_REACH,
    GOAL_X,
    GOAL_Y,
    GROUND_ROW,
    HEIGHT,
    LAMP_ROW,
    LIGHT_ROW,
    MOTOR_GAIN,
    MOTOR_REST,
    N_BOXES,
    N_GROUND,
    N_LAMPS,
    N_LIGHT,
    N_RAYS,
    N_ROUND,
    N_WALLS,
    NODES,
    NOISE,
    RADIUS,
    RAY_ROW,
    ROUND_ROW,
    SHADE_COLUMNS,
    SHADE_COLUMNS_PER_M,
    SHADE_ROWS,
    SHADE_ROWS_PER_M,
    STEP_M,
    WALL_ROW,
    WHEEL_INTERVAL,
    WIDTH,
    Motion,
    Senses,
    World,
    packed,
)
from backends.world.picture import draw
from backends.world.rays import COS, DX, DY, NEAR, OX, OY, SIN, aim, meet_arena, meet_things
from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.neurons import LANES
from sceann_hil.robot import EndReason, RobotSpec
from sceann_hil.robot.drawing import Drawing

_F = np.float32
_GOAL, _OUT = int(EndReason.GOAL), int(EndReason.OUT_OF_BOUNDS)
BUMPED, BRIGHT, AWAY = 7, 8, 9
"""Further rows of scratch memory: 1 where the body met something; a lamp's brightness without shadow, its distance."""

Float32Array = NDArray[np.float32]


@compiled_part
def _sense(state: Float32Array, sensors: Float32Array, work: Float32Array, parameters: Float32Array) -> None:
    for lane in range(LANES):
        work[COS, lane] = cosine(state[2, lane])
        work[SIN, lane] = sine(state[2, lane])
    for j in range(sensors.shape[0]):
        for lane in range(LANES):
            sensors[j, lane] = _F(0.0)
    for k in range(np.int64(parameters[N_RAYS])):
        row = np.int64(parameters[AT_RAYS]) + RAY_ROW * k
        aim(state, work, parameters[row + 2], parameters[row + 3], parameters[row + 4], parameters[row + 5])
        reach = parameters[row + 6]
        for lane in range(LANES):
            work[NEAR, lane] = reach
        meet_arena(work, parameters)
        meet_things(work, parameters)
        sensor, weight = np.int64(parameters[row]), parameters[row + 1]
        response = np.int64(parameters[AT_RESPONSES]) + np.int64(parameters[row + 7])
        if np.int64(parameters[row + 7]) < 0:
            # the default response needs no table, and looking one up costs more than meeting the walls
            per_m = weight / reach
            for lane in range(LANES):
                sensors[sensor, lane] += weight - per_m * work[NEAR, lane]
        else:
            _respond(sensors, work, parameters, sensor, weight, response, _F(NODES - 1) / reach)
    _sense_ground(state, sensors, work, parameters)
    _sense_light(state, sensors, work, parameters)


@compiled_part
def _respond(
    sensors: Float32Array,
    work: Float32Array,
    parameters: Float32Array,
    sensor: np.int64,
    weight: np.float32,
    response: np.int64,
    per_m: np.float32,
) -> None:
    """Add what a ray reads at its distance: between two nodes of the table that begins at `response`."""
    for lane in range(LANES):
        at = work[NEAR, lane] * per_m
        node = min(np.int32(at), np.int32(NODES - 2))
        low = parameters[response + node]
        sensors[sensor, lane] += weight * (low + (at - _F(node)) * (parameters[response + node + 1] - low))


@compiled_part
def _sense_ground(state: Float32Array, sensors: Float32Array, work: Float32Array, parameters: Float32Array) -> None:
    columns, rows = np.int32(parameters[SHADE_COLUMNS]), np.int32(parameters[SHADE_ROWS])
    first = np.int32(parameters[AT_SHADES])
    columns_per_m, rows_per_m = parameters[SHADE_COLUMNS_PER_M], parameters[SHADE_ROWS_PER_M]
    for k in range(np.int64(parameters[N_GROUND])):
        row = np.int64(parameters[AT_GROUND]) + GROUND_ROW * k
        aim(state, work, parameters[row], parameters[row + 1], _F(1.0), _F(0.0))
        sensor = np.int64(parameters[FIRST_GROUND]) + k
        for lane in range(LANES):
            # between the middles of four cells
            x = min(max(work[OX, lane] * columns_per_m - _F(0.5), _F(0.0)), _F(columns - 1))
            y = min(max(work[OY, lane] * rows_per_m - _F(0.5), _F(0.0)), _F(rows - 1))
            column, line = min(np.int32(x), columns - np.int32(2)), min(np.int32(y), rows - np.int32(2))
            fx, fy = x - _F(column), y - _F(line)
            cell = first + line * columns + column
            below = parameters[cell] + fx * (parameters[cell + 1] - parameters[cell])
            upper = cell + columns
            above = parameters[upper] + fx * (parameters[upper + 1] - parameters[upper])
            sensors[sensor, lane] = _F(1.0) - (below + fy * (above - below))


@compiled_part
def _sense_light(state: Float32Array, sensors: Float32Array, work: Float32Array, parameters: Float32Array) -> None:
    for k in range(np.int64(parameters[N_LIGHT])):
        row = np.int64(parameters[AT_LIGHT]) + LIGHT_ROW * k
        sensor = np.int64(parameters[FIRST_LIGHT]) + k
        for lamp in range(np.int64(parameters[N_LAMPS])):
            at = np.int64(parameters[AT_LAMPS]) + LAMP_ROW * lamp
            x, y, reference = parameters[at], parameters[at + 1], parameters[at + 2]
            aim(state, work, parameters[row], parameters[row + 1], parameters[row + 2], parameters[row + 3])
            for lane in range(LANES):
                to_x, to_y = x - work[OX, lane], y - work[OY, lane]
                away = max(np.sqrt(to_x * to_x + to_y * to_y), _F(1e-6))
                facing = max((to_x * work[DX, lane] + to_y * work[DY, lane]) / away, _F(0.0))
                near = reference / away
                work[BRIGHT, lane] = min(near * near, _F(1.0)) * facing
                # now the ray runs towards the lamp, and what it meets on its way throws a shadow
                work[DX, lane], work[DY, lane] = to_x / away, to_y / away
                work[AWAY, lane], work[NEAR, lane] = away, away
            meet_things(work, parameters)
            for lane in range(LANES):
                sensors[sensor, lane] += work[BRIGHT, lane] if work[NEAR, lane] >= work[AWAY, lane] else _F(0.0)


@compiled_part
def _advance(
    state: Float32Array,
    motors: Float32Array,
    noise: Float32Array,
    end_reasons: NDArray[np.int32],
    work: Float32Array,
    parameters: Float32Array,
) -> None:
    radius, level, interval = parameters[RADIUS], parameters[NOISE], parameters[WHEEL_INTERVAL]
    speed, rest = parameters[STEP_M] * parameters[MOTOR_GAIN], parameters[MOTOR_REST]
    for lane in range(LANES):
        left = speed * (motors[0, lane] - rest)
        right = speed * (motors[1, lane] - rest)
        heading = state[2, lane]
        forward = _F(0.5) * (right + left)
        dx = forward * cosine(heading)
        dy = forward * sine(heading)
        turn = (right - left) / interval
        state[0, lane] += dx + level * abs(dx) * noise[0, lane]
        state[1, lane] += dy + level * abs(dy) * noise[1, lane]
        state[2, lane] = wrap_angle(heading + turn + level * abs(turn) * noise[2, lane])
        work[BUMPED, lane] = _F(0.0)
    _slide_along_things(state, work, parameters)
    for lane in range(LANES):
        x = min(max(state[0, lane], radius), parameters[WIDTH] - radius)
        y = min(max(state[1, lane], radius), parameters[HEIGHT] - radius)
        bumped = work[BUMPED, lane] > _F(0.0) or x != state[0, lane] or y != state[1, lane]
        state[0, lane], state[1, lane] = x, y
        gx, gy = parameters[GOAL_X] - x, parameters[GOAL_Y] - y
        reach = parameters[GOAL_REACH]
        at_goal = reach >= _F(0.0) and gx * gx + gy * gy <= reach * reach
        out = bumped and parameters[BUMP_ENDS] > _F(0.0)
        end = np.int32(_OUT) if out else np.int32(RUNNING)
        end_reasons[lane] = np.int32(_GOAL) if at_goal else end


@compiled_part
def _slide_along_things(state: Float32Array, work: Float32Array, parameters: Float32Array) -> None:
    """Push the body out of whatever it entered, along the shortest way."""
    radius = parameters[RADIUS]
    for k in range(np.int64(parameters[N_ROUND])):
        row = np.int64(parameters[AT_ROUND]) + ROUND_ROW * k
        cx, cy, reach = parameters[row], parameters[row + 1], parameters[row + 2] + radius
        for lane in range(LANES):
            _push(state, work, lane, cx, cy, reach)
    for k in range(np.int64(parameters[N_BOXES])):
        row = np.int64(parameters[AT_BOXES]) + BOX_ROW * k
        cx, cy, c, s = parameters[row], parameters[row + 1], parameters[row + 2], parameters[row + 3]
        half_x, half_y = parameters[row + 4], parameters[row + 5]
        for lane in range(LANES):
            rx, ry = state[0, lane] - cx, state[1, lane] - cy
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
            state[0, lane], state[1, lane] = cx + c * mx - s * my, cy + s * mx + c * my
            work[BUMPED, lane] = _F(1.0) if hit else work[BUMPED, lane]
    for k in range(np.int64(parameters[N_WALLS])):
        row = np.int64(parameters[AT_WALLS]) + WALL_ROW * k
        ax, ay, ex, ey = parameters[row], parameters[row + 1], parameters[row + 2], parameters[row + 3]
        inverse = _F(1.0) / max(ex * ex + ey * ey, _F(1e-12))
        for lane in range(LANES):
            part = ((state[0, lane] - ax) * ex + (state[1, lane] - ay) * ey) * inverse
            part = min(max(part, _F(0.0)), _F(1.0))
            _push(state, work, lane, ax + part * ex, ay + part * ey, radius)


@compiled_part
def _push(state: Float32Array, work: Float32Array, lane: int, x: np.float32, y: np.float32, reach: np.float32) -> None:
    """Keep a lane's body at least `reach` away from a point."""
    dx, dy = state[0, lane] - x, state[1, lane] - y
    away = np.sqrt(dx * dx + dy * dy)
    hit = away < reach
    scale = reach / max(away, _F(1e-6))
    state[0, lane] = x + dx * scale if hit else state[0, lane]
    state[1, lane] = y + dy * scale if hit else state[1, lane]
    work[BUMPED, lane] = _F(1.0) if hit else work[BUMPED, lane]


class WorldDrive(SimulatedRobot):
    """A round robot with two wheels in a world. Motors: left, right; see `Motion` for what their values mean.

    Args:
        world: what is there.
        senses: what it can feel of it.
        motion: its size, speed and errors.
        tick_s: control step.
        gap: the body's imperfections.
        threads: cores to use; None for all.
    """

    sense = staticmethod(_sense)
    advance = staticmethod(_advance)
    n_noise = 3

    def __init__(
        self,
        world: World,
        senses: Senses,
        motion: Motion,
        tick_s: float,
        gap: Gap = Gap(),  # noqa: B008
        threads: int | None = None,
    ) -> None:
        super().__init__(gap, threads)
        self.world, self.senses, self.motion = world, senses, motion
        self.neutral_motor = motion.rest
        self._spec = RobotSpec(
            name="diffdrive in a world",
            n_sensors=senses.count,
            n_motors=2,
            tick_s=tick_s,
            start_fields=("x_m", "y_m", "heading_rad"),
            state_fields=("x_m", "y_m", "heading_rad"),
            noise_free=gap.is_none and motion.noise == 0.0,
        )

    @property
    def spec(self) -> RobotSpec:
        return self._spec

    @property
    def drawing(self) -> Drawing:
        return draw(self.world, self.senses, self.motion)

    @cached_property
    def parameters(self) -> NDArray[np.float32]:
        return packed(self.world, self.senses, self.motion)

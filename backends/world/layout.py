"""A world and a robot's sensors as one array of float32 numbers, as the compiled body reads them.

The array begins with `HEAD` numbers: the motion, how many things of each kind there are, and where their rows begin.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from backends.world.drawn import DrawnObstacle

(
    STEP_M,
    RADIUS,
    WHEEL_INTERVAL,
    WIDTH,
    HEIGHT,
    NOISE,
    GOAL_X,
    GOAL_Y,
    GOAL_REACH,
    BUMP_ENDS,
    MOTOR_GAIN,
    MOTOR_REST,
    N_ROUND,
    N_BOXES,
    N_WALLS,
    N_LAMPS,
    N_RAYS,
    N_GROUND,
    N_LIGHT,
    N_DRAWN_ROUND,
    N_DRAWN_BOXES,
    AT_ROUND,
    AT_BOXES,
    AT_WALLS,
    AT_LAMPS,
    AT_RAYS,
    AT_GROUND,
    AT_LIGHT,
    AT_RESPONSES,
    AT_SHADES,
    AT_DRAWN_ROUND,
    AT_DRAWN_BOXES,
    SHADE_COLUMNS,
    SHADE_ROWS,
    SHADE_COLUMNS_PER_M,
    SHADE_ROWS_PER_M,
    FIRST_GROUND,
    FIRST_LIGHT,
    HEAD,
) = range(39)

ROUND_ROW, BOX_ROW, WALL_ROW, LAMP_ROW, RAY_ROW, GROUND_ROW, LIGHT_ROW = 3, 6, 4, 3, 8, 2, 4
DRAWN_ROUND_ROW, DRAWN_BOX_ROW = 1, 2
FIRST_DRAWN, DRAWN_ROUND_STATE, DRAWN_BOX_STATE = 3, 2, 3
"""Places of drawn obstacles in the state: after the robot's own, the round ones (x, y), then boxes (x, y, angle)."""
NODES = 33
"""Numbers of a response curve, at equal distances from 0 to the sensor's range."""


@dataclass(frozen=True, slots=True)
class Round:
    """A round obstacle: centre and radius, metres."""

    at_m: tuple[float, float]
    radius_m: float


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangular obstacle: centre, width and height in metres, turned counter-clockwise by an angle."""

    at_m: tuple[float, float]
    size_m: tuple[float, float]
    angle_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Wall:
    """A thin wall from one point to another, metres."""

    from_m: tuple[float, float]
    to_m: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp: where it is, and the distance at which a sensor that looks at it reads 1."""

    at_m: tuple[float, float]
    reference_m: float


@dataclass(frozen=True, slots=True)
class Infrared:
    """A distance sensor on the robot's body, seen from its centre with its nose along x.

    Attributes:
        at_m: where it is.
        direction_rad: where it looks, counter-clockwise from straight ahead.
        range_m: how far it sees.
        response: reading 0..1 at `NODES` equal steps of distance from 0 to the range; None for 1 at contact, falling
            evenly to 0 at the range.
        half_width_rad: half of its opening.
        rays: how many lines stand for that opening; the reading is their mean.
        ray_responses: instead of `response` a curve for each ray; the reading is their sum.
    """

    at_m: tuple[float, float]
    direction_rad: float
    range_m: float
    response: tuple[float, ...] | None = None
    half_width_rad: float = 0.0
    rays: int = 1
    ray_responses: tuple[tuple[float, ...], ...] | None = None


@dataclass(frozen=True, slots=True)
class Light:
    """A light sensor: where it is on the body, and where it looks."""

    at_m: tuple[float, float]
    direction_rad: float


@dataclass(frozen=True, slots=True)
class Line:
    """A line on the floor as it was given, for pictures; the robot feels `World.shades`."""

    points_m: tuple[tuple[float, float], ...]
    width_m: float


@dataclass(frozen=True, slots=True)
class World:
    """What stands in an arena ``[0, width] x [0, height]`` besides its four walls.

    Attributes:
        arena_m: width and height.
        rounds: round obstacles.
        boxes: rectangular obstacles.
        walls: inner walls.
        lamps: lamps; obstacles and inner walls throw shadows.
        shades: how dark the floor is, 0 white to 1 black, on a grid of square cells from the lower left corner, shape
            ``(rows, columns)``; None for a white floor.
        shades_per_m: columns and rows of it per metre.
        floor_line: what the shades show, if it is a line.
        goal_m: centre of the target; None if there is none.
        goal_radius_m: its radius.
        drawn: obstacles that stand somewhere else in every trial.
    """

    arena_m: tuple[float, float]
    rounds: tuple[Round, ...] = ()
    boxes: tuple[Box, ...] = ()
    walls: tuple[Wall, ...] = ()
    lamps: tuple[Lamp, ...] = ()
    shades: NDArray[np.float32] | None = None
    shades_per_m: tuple[float, float] = (1.0, 1.0)
    floor_line: Line | None = None
    goal_m: tuple[float, float] | None = None
    goal_radius_m: float = 0.0
    drawn: tuple[DrawnObstacle, ...] = ()

    @property
    def drawn_in_order(self) -> tuple[DrawnObstacle, ...]:
        """The drawn obstacles as the state has them: round ones first."""
        return tuple(sorted(self.drawn, key=lambda thing: thing.size_m is not None))


@dataclass(frozen=True, slots=True)
class Senses:
    """What the robot can feel, in the order of the controller's sensors: infrared, then ground, then light."""

    infrared: tuple[Infrared, ...] = ()
    ground_at_m: tuple[tuple[float, float], ...] = ()
    light: tuple[Light, ...] = ()

    @property
    def count(self) -> int:
        """How many."""
        return len(self.infrared) + len(self.ground_at_m) + len(self.light)


@dataclass(frozen=True, slots=True)
class Motion:
    """How the robot moves.

    Attributes:
        step_m: way of a wheel in one control step at full speed.
        radius_m: of the body.
        wheel_interval_m: distance between the wheels.
        noise: standard deviation of Eq. (4)'s errors, as a part of the step's displacement.
        backwards: motor value 0 is full speed backwards and 0.5 is rest; otherwise 0 is rest.
        bump_ends: a trial ends where the body meets something; otherwise it slides along.
    """

    step_m: float
    radius_m: float
    wheel_interval_m: float
    noise: float = 0.0
    backwards: bool = True
    bump_ends: bool = False

    @property
    def rest(self) -> float:
        """The motor value at which nothing moves."""
        return 0.5 if self.backwards else 0.0


def packed(world: World, senses: Senses, motion: Motion) -> NDArray[np.float32]:
    """Everything in one array; see the module."""
    head = np.zeros(HEAD)
    width, height = world.arena_m
    head[[STEP_M, RADIUS, WHEEL_INTERVAL, WIDTH, HEIGHT, NOISE]] = (
        motion.step_m,
        motion.radius_m,
        motion.wheel_interval_m,
        width,
        height,
        motion.noise,
    )
    head[BUMP_ENDS] = motion.bump_ends
    head[[MOTOR_GAIN, MOTOR_REST]] = 1.0 / (1.0 - motion.rest), motion.rest
    head[GOAL_REACH] = -1.0
    if world.goal_m is not None:
        head[[GOAL_X, GOAL_Y, GOAL_REACH]] = (*world.goal_m, motion.radius_m + world.goal_radius_m)
    rays, responses = _rays(senses.infrared)
    shades = np.zeros((2, 2), np.float32) if world.shades is None else world.shades
    head[[SHADE_ROWS, SHADE_COLUMNS]] = shades.shape
    head[[SHADE_COLUMNS_PER_M, SHADE_ROWS_PER_M]] = world.shades_per_m
    head[FIRST_GROUND] = len(senses.infrared)
    head[FIRST_LIGHT] = len(senses.infrared) + len(senses.ground_at_m)
    drawn_radii = [it.radius_m for it in world.drawn if it.radius_m is not None]
    drawn_sizes = [it.size_m for it in world.drawn if it.size_m is not None]
    tables: Sequence[tuple[int | None, int, NDArray[np.float64]]] = (
        (N_ROUND, AT_ROUND, _table([(*it.at_m, it.radius_m) for it in world.rounds], ROUND_ROW)),
        (N_BOXES, AT_BOXES, _table([_box(it) for it in world.boxes], BOX_ROW)),
        (N_WALLS, AT_WALLS, _table([_wall(it) for it in world.walls], WALL_ROW)),
        (N_LAMPS, AT_LAMPS, _table([(*it.at_m, it.reference_m) for it in world.lamps], LAMP_ROW)),
        (N_RAYS, AT_RAYS, _table(rays, RAY_ROW)),
        (N_GROUND, AT_GROUND, _table(list(senses.ground_at_m), GROUND_ROW)),
        (N_LIGHT, AT_LIGHT, _table([(*it.at_m, *_unit(it.direction_rad)) for it in senses.light], LIGHT_ROW)),
        (None, AT_RESPONSES, _table(responses, NODES)),
        (None, AT_SHADES, shades.astype(np.float64)),
        (N_DRAWN_ROUND, AT_DRAWN_ROUND, _table([(radius,) for radius in drawn_radii], DRAWN_ROUND_ROW)),
        (N_DRAWN_BOXES, AT_DRAWN_BOXES, _table([(x / 2.0, y / 2.0) for x, y in drawn_sizes], DRAWN_BOX_ROW)),
    )
    place = HEAD
    for count_at, begins_at, table in tables:
        if count_at is not None:
            head[count_at] = len(table)
        head[begins_at] = place
        place += table.size
    return np.concatenate([head, *(table.ravel() for _, _, table in tables)]).astype(np.float32)


def _rays(sensors: tuple[Infrared, ...]) -> tuple[list[tuple[float, ...]], list[tuple[float, ...]]]:
    rays: list[tuple[float, ...]] = []
    responses: list[tuple[float, ...]] = []
    for number, sensor in enumerate(sensors):
        curves = sensor.ray_responses or (sensor.response,) * sensor.rays
        weight = 1.0 if sensor.ray_responses else 1.0 / sensor.rays
        responses += [curve for curve in dict.fromkeys(curves) if curve is not None and curve not in responses]
        # each ray stands in the middle of an equal part of the opening
        parts = (np.arange(sensor.rays) + 0.5) / sensor.rays * 2.0 - 1.0
        for part, curve in zip(parts.tolist(), curves, strict=True):
            direction = _unit(sensor.direction_rad + part * sensor.half_width_rad)
            which = -1 if curve is None else responses.index(curve) * NODES
            rays.append((number, weight, *sensor.at_m, *direction, sensor.range_m, which))
    return rays, responses


def _table(rows: Sequence[Sequence[float]], width: int) -> NDArray[np.float64]:
    return np.array(rows, np.float64).reshape(-1, width)


def _unit(angle_rad: float) -> tuple[float, float]:
    return float(np.cos(angle_rad)), float(np.sin(angle_rad))


def _box(box: Box) -> tuple[float, ...]:
    return (*box.at_m, *_unit(box.angle_rad), box.size_m[0] / 2.0, box.size_m[1] / 2.0)


def _wall(wall: Wall) -> tuple[float, ...]:
    return (*wall.from_m, wall.to_m[0] - wall.from_m[0], wall.to_m[1] - wall.from_m[1])

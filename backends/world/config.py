"""The ``world`` of a two-wheeled robot: what stands in its arena, and what it can feel of that."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from backends.world.distances import to_box, to_round
from backends.world.drawn import LEAST_FREE, DrawnObstacle, KeptFree
from backends.world.ground import CELLS_PER_M, line_shades, map_shades
from backends.world.layout import Box, Infrared, Lamp, Light, Line, Round, Senses, Wall, World
from backends.world.response import fitted
from sceann_hil.plugins import Misfit, Section

Point = tuple[float, float]
Range = tuple[float, float]
Positive = Annotated[float, Field(gt=0.0)]
Degrees = Annotated[float, Field(ge=-360.0, le=360.0)]


class Placement(Section):
    """Where an obstacle may stand: another place in every trial, drawn evenly from these ranges."""

    x_m: Range
    """Of its centre, from and to, metres."""
    y_m: Range
    """Of its centre, from and to, metres."""
    angle_deg: tuple[Degrees, Degrees] = (0.0, 0.0)
    """How far a rectangular one is turned, from and to."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        for name in ("x_m", "y_m", "angle_deg"):
            low, high = getattr(self, name)
            if low > high:
                raise Misfit(f"{name}: expected the smaller value first, got [{low:g}, {high:g}]", name)
        return self


class ObstacleConfig(Section):
    """Something that the robot cannot drive through and that infrared sees: round or rectangular."""

    at_m: Point | None = None
    """Its centre: x and y, metres."""
    drawn: Placement | None = None
    """Instead of at_m: it stands somewhere else in every trial."""
    radius_m: Positive | None = None
    """Of a round one."""
    size_m: tuple[Positive, Positive] | None = None
    """Width and height of a rectangular one."""
    angle_deg: Degrees = 0.0
    """How far a rectangular one is turned, counter-clockwise."""

    @model_validator(mode="after")
    def _has_one_shape_and_place(self) -> Self:
        if (self.radius_m is None) == (self.size_m is None):
            raise Misfit("radius_m: expected either radius_m (round) or size_m (rectangular)", "radius_m", "size_m")
        if (self.at_m is None) == (self.drawn is None):
            raise Misfit("at_m: expected either at_m or drawn", "at_m", "drawn")
        if self.drawn is not None and self.angle_deg != 0.0:
            raise Misfit("angle_deg: expected drawn.angle_deg, because its place is drawn", "angle_deg")
        if self.size_m is None and (self.drawn is not None and self.drawn.angle_deg != (0.0, 0.0)):
            raise Misfit("drawn.angle_deg: expected nothing here, a round one cannot be turned", "drawn.angle_deg")
        return self

    def distance_m(self, point: Point) -> float:
        """From the edge of one that stands still to a point outside; negative inside."""
        if self.at_m is None:
            raise ValueError("expected at_m")
        dx, dy = point[0] - self.at_m[0], point[1] - self.at_m[1]
        if self.size_m is not None:
            return float(to_box(dx, dy, self.size_m, np.deg2rad(self.angle_deg)))
        return float(to_round(dx, dy, self.radius_m or 0.0))

    def as_drawn(self, number: int) -> DrawnObstacle | None:
        """One that stands somewhere else in every trial; `number` is its place among the obstacles."""
        if self.drawn is None:
            return None
        low, high = (float(np.deg2rad(angle)) for angle in self.drawn.angle_deg)
        return DrawnObstacle(number, self.drawn.x_m, self.drawn.y_m, self.radius_m, self.size_m, (low, high))


class WallConfig(Section):
    """A thin inner wall."""

    from_m: Point
    """One end: x and y, metres."""
    to_m: Point
    """The other end."""

    @model_validator(mode="after")
    def _has_a_length(self) -> Self:
        if self.from_m == self.to_m:
            raise Misfit(f"to_m: expected another point than from_m, got {list(self.to_m)}", "to_m", "from_m")
        return self

    def distance_m(self, point: Point) -> float:
        """From the wall to a point."""
        (ax, ay), (bx, by) = self.from_m, self.to_m
        ex, ey = bx - ax, by - ay
        part = np.clip(((point[0] - ax) * ex + (point[1] - ay) * ey) / (ex * ex + ey * ey), 0.0, 1.0)
        return float(np.hypot(point[0] - ax - part * ex, point[1] - ay - part * ey))


class LampConfig(Section):
    """A lamp, seen by light sensors unless something stands between."""

    at_m: Point
    """Where it is: x and y, metres."""
    reference_m: Positive = 0.1
    """A sensor that looks at it from here or nearer reads 1; beyond, it falls with the square of the distance."""


class LineConfig(Section):
    """A black line on a white floor."""

    points_m: Annotated[tuple[Point, ...], Field(min_length=2, max_length=1000)]
    """Its corners, metres."""
    width_m: Positive = 0.02
    """How wide it is."""
    closed: bool = False
    """The last corner is joined to the first."""


class InfraredConfig(Section):
    """A distance sensor."""

    direction_deg: Degrees
    """Where it looks, counter-clockwise from straight ahead."""
    at_m: Point | None = None
    """Where it is on the robot, seen from its centre, nose along x; default: on the rim, where it looks."""
    range_m: Positive = 0.1
    """How far it sees."""
    half_width_deg: Annotated[float, Field(ge=0.0, le=90.0)] = 0.0
    """Half of its opening."""
    rays: Annotated[int, Field(ge=1, le=15)] = 1
    """Lines that stand for the opening; the sensor reads their mean."""
    response: Annotated[tuple[tuple[float, float], ...], Field(max_length=1000)] = ()
    """Measured pairs of distance in metres and reading 0..1; default: 1 at contact, evenly down to 0 at the range."""

    @model_validator(mode="after")
    def _can_be_fitted(self) -> Self:
        if len({distance for distance, _ in self.response}) == 1:
            raise Misfit("response: expected readings of at least 2 distances, got those of 1", "response")
        for distance, reading in self.response:
            if not (0.0 <= distance <= self.range_m and 0.0 <= reading <= 1.0):
                raise Misfit(
                    f"response: expected distances 0..{self.range_m:g} m and readings 0..1, got "
                    f"[{distance:g}, {reading:g}]",
                    "response",
                    "range_m",
                )
        return self

    def sensor(self, radius_m: float) -> Infrared:
        """On a robot of this radius."""
        return Infrared(
            at_m=self.at_m or on_rim(radius_m, self.direction_deg),
            direction_rad=float(np.deg2rad(self.direction_deg)),
            range_m=self.range_m,
            response=fitted(self.response, self.range_m) if self.response else None,
            half_width_rad=float(np.deg2rad(self.half_width_deg)),
            rays=self.rays,
        )


class GroundConfig(Section):
    """A ground sensor: 1 over white, 0 over black."""

    at_m: Point
    """Where it is on the robot, seen from its centre, nose along x."""


class LightConfig(Section):
    """A light sensor: the sum over lamps of brightness times the cosine of the angle at which it sees them."""

    direction_deg: Degrees
    """Where it looks, counter-clockwise from straight ahead."""
    at_m: Point | None = None
    """Where it is on the robot, seen from its centre, nose along x; default: on the rim, where it looks."""


class WorldConfig(Section):
    """What stands in the arena besides its four walls, and what the robot feels of it."""

    obstacles: Annotated[tuple[ObstacleConfig, ...], Field(max_length=100)] = ()
    """Round and rectangular ones."""
    walls: Annotated[tuple[WallConfig, ...], Field(max_length=100)] = ()
    """Inner walls."""
    lamps: Annotated[tuple[LampConfig, ...], Field(max_length=10)] = ()
    """Lamps; obstacles and inner walls throw shadows."""
    line: LineConfig | None = None
    """A black line on a white floor."""
    shades: Annotated[tuple[tuple[Annotated[float, Field(ge=0.0, le=1.0)], ...], ...], Field(max_length=1000)] = ()
    """Instead of a line: rows of shades, the upper one first, 0 white to 1 black, spread over the arena."""
    target: Literal["none", "hidden", "solid"] = "none"
    """none: there is no goal. hidden: touching target_m is the goal, but infrared does not see it. solid: it does."""
    infrared: Annotated[tuple[InfraredConfig, ...], Field(max_length=20)] = ()
    """Distance sensors; they come first among the controller's sensors."""
    ground: Annotated[tuple[GroundConfig, ...], Field(max_length=20)] = ()
    """Ground sensors; they come next."""
    light: Annotated[tuple[LightConfig, ...], Field(max_length=20)] = ()
    """Light sensors; they come last."""
    wheel_interval_m: Positive | None = None
    """Distance between the wheels; default: the robot's diameter."""
    backwards: bool = True
    """Motor value 0 is full speed backwards and 0.5 is rest; false: 0 is rest, as in the paper."""
    bump: Literal["slide", "end"] = "slide"
    """What happens where the body meets something: it slides along, or the trial ends (out_of_bounds)."""

    def usual_uncertainty(self, radius_m: float) -> dict[str, Any]:
        """What is usually not known of a robot of this radius in it, by key of the robot's section."""
        interval_m = self.wheel_interval_m or 2.0 * radius_m
        usual: dict[str, Any] = {"world.wheel_interval_m": {"uniform": [0.85 * interval_m, 1.2 * interval_m]}}
        for key, sensors in (("infrared", self.infrared), ("light", self.light)):
            if sensors and max(abs(it.direction_deg) for it in sensors) <= 355.0:
                usual[f"world.{key}.direction_deg"] = {"shifted": [-5.0, 5.0]}
        if self.infrared and not any(it.response for it in self.infrared):
            # a measured response ends at its range
            usual["world.infrared.range_m"] = {"scaled": [0.7, 1.4]}
        if self.light and self.lamps:
            usual["world.lamps.reference_m"] = {"scaled": [0.6, 1.5]}
        return usual

    def check(self, arena_m: Point, target_m: Point, target_radius_m: float) -> None:
        """Refuse a world that does not fit its arena or itself.

        Raises:
            Misfit: what does not, and what would.
        """
        if not (self.infrared or self.ground or self.light):
            raise Misfit("world: expected at least one sensor in infrared, ground or light", "world.infrared")
        if self.line is not None and self.shades:
            raise Misfit("world.shades: expected either line or shades", "world.shades", "world.line")
        columns = {len(row) for row in self.shades}
        if self.shades and (len(self.shades) < 2 or len(columns) != 1 or max(columns) < 2):
            raise Misfit("world.shades: expected at least 2 rows of one length, at least 2 each", "world.shades")
        points: list[tuple[str, Point]] = [("obstacles", it.at_m) for it in self.obstacles if it.at_m is not None]
        ranges = [it.drawn for it in self.obstacles if it.drawn is not None]
        points += [("obstacles", corner) for it in ranges for corner in zip(it.x_m, it.y_m, strict=True)]
        points += [("walls", end) for it in self.walls for end in (it.from_m, it.to_m)]
        points += [("lamps", it.at_m) for it in self.lamps]
        points += [("line", point) for point in (self.line.points_m if self.line else ())]
        for key, (x, y) in points:
            if not (0.0 <= x <= arena_m[0] and 0.0 <= y <= arena_m[1]):
                raise Misfit(
                    f"world.{key}: expected a point in the arena, 0..{arena_m[0]:g} and 0..{arena_m[1]:g} m, got "
                    f"[{x:g}, {y:g}]",
                    f"world.{key}",
                    "arena_m",
                )
        if self.line is not None:
            for a, b in pairwise(self.line.points_m):
                if a == b:
                    raise Misfit(f"world.line: expected different corners, got {list(a)} twice in a row", "world.line")

        for number, obstacle in enumerate(self.obstacles):
            hides = obstacle.at_m is not None and obstacle.distance_m(target_m) < -target_radius_m
            if self.target != "none" and hides:
                raise Misfit(
                    f"world.obstacles: expected the target at {list(target_m)} outside of obstacles, got one that "
                    f"stands over it, obstacles[{number}]",
                    "world.obstacles",
                    "target_m",
                )

    def standing_in(self, point: Point, radius_m: float, target_m: Point, target_radius_m: float) -> str:
        """Why a body cannot begin at this point, in words that go on after "where"; empty if it can."""
        kept = KeptFree(radius_m, None if self.target == "none" else target_m, target_radius_m)
        for number, obstacle in enumerate(self.obstacles):
            thing = obstacle.as_drawn(number)
            if thing is None and obstacle.distance_m(point) < radius_m:
                return f"world.obstacles[{number}] stands"
            free = 1.0 if thing is None else kept.free(thing, *point)
            if free < LEAST_FREE:
                return (
                    f"world.obstacles[{number}] would stand, or on the target, in {1.0 - free:.0%} of the places drawn "
                    f"for it (at most {1.0 - LEAST_FREE:.0%} may be)"
                )
        for number, wall in enumerate(self.walls):
            if wall.distance_m(point) < radius_m:
                return f"world.walls[{number}] stands"
        return ""

    def world(self, arena_m: Point, target_m: Point, target_radius_m: float) -> World:
        """Ready to be simulated."""
        still = [(it, it.at_m) for it in self.obstacles if it.at_m is not None]
        rounds = [Round(at_m, it.radius_m) for it, at_m in still if it.radius_m is not None]
        if self.target == "solid":
            rounds.append(Round(target_m, target_radius_m))
        shades, per_m = self._shades(arena_m)
        return World(
            arena_m=arena_m,
            rounds=tuple(rounds),
            boxes=tuple(
                Box(at_m, it.size_m, float(np.deg2rad(it.angle_deg))) for it, at_m in still if it.size_m is not None
            ),
            walls=tuple(Wall(it.from_m, it.to_m) for it in self.walls),
            lamps=tuple(Lamp(it.at_m, it.reference_m) for it in self.lamps),
            shades=shades,
            shades_per_m=per_m,
            floor_line=self._floor_line(),
            goal_m=None if self.target == "none" else target_m,
            goal_radius_m=target_radius_m,
            drawn=tuple(
                thing for number, it in enumerate(self.obstacles) if (thing := it.as_drawn(number)) is not None
            ),
        )

    def _floor_line(self) -> Line | None:
        if self.line is None:
            return None
        points = self.line.points_m
        return Line((*points, points[0]) if self.line.closed else points, self.line.width_m)

    def _shades(self, arena_m: Point) -> tuple[NDArray[np.float32] | None, tuple[float, float]]:
        if self.line is not None:
            shades = line_shades(arena_m, self.line.points_m, self.line.width_m, closed=self.line.closed)
            return shades, (CELLS_PER_M, CELLS_PER_M)
        if self.shades:
            shades = map_shades(self.shades)
            return shades, (shades.shape[1] / arena_m[0], shades.shape[0] / arena_m[1])
        return None, (1.0, 1.0)

    def senses(self, radius_m: float) -> Senses:
        """On a robot of this radius."""
        return Senses(
            infrared=tuple(it.sensor(radius_m) for it in self.infrared),
            ground_at_m=tuple(it.at_m for it in self.ground),
            light=tuple(
                Light(it.at_m or on_rim(radius_m, it.direction_deg), float(np.deg2rad(it.direction_deg)))
                for it in self.light
            ),
        )


def on_rim(radius_m: float, direction_deg: float) -> Point:
    """The point of a round body in this direction."""
    angle = np.deg2rad(direction_deg)
    return float(radius_m * np.cos(angle)), float(radius_m * np.sin(angle))

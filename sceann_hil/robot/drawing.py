"""What a robot looks like, in a small vocabulary that every viewer and every picture of a start pose understands.

A drawing has shapes that stand still and parts that move. A part follows fields of the body's state, by their names,
and may be fixed to another part. Lengths are in metres, x to the right and y up, angles counter-clockwise.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

Point = tuple[float, float]


class Look(Enum):
    """What a shape is; viewers choose colours by it."""

    WALL = auto()
    OBSTACLE = auto()
    TARGET = auto()
    LAMP = auto()
    LINE = auto()
    MARK = auto()
    LIMIT = auto()
    BODY = auto()
    NOSE = auto()
    WHEEL = auto()
    CART = auto()
    TIP = auto()


@dataclass(frozen=True, slots=True)
class Disc:
    """A filled circle."""

    at_m: Point
    radius_m: float
    look: Look


@dataclass(frozen=True, slots=True)
class Strip:
    """A line with corners."""

    points_m: tuple[Point, ...]
    width_m: float
    look: Look


@dataclass(frozen=True, slots=True)
class Block:
    """A filled rectangle: centre, width and height, turned by an angle."""

    at_m: Point
    size_m: Point
    look: Look
    angle_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Shades:
    """How dark the floor is: 0 white to 1 black, on equal cells of a rectangle from the origin, lowest row first."""

    size_m: Point
    rows: tuple[tuple[float, ...], ...]


Shape = Disc | Strip | Block | Shades


@dataclass(frozen=True, slots=True)
class Fan:
    """The field of a sensor, which lights up with what it reads: from a point, about a direction, so far."""

    at_m: Point
    direction_rad: float
    half_width_rad: float
    reach_m: float


@dataclass(frozen=True, slots=True)
class Arrow:
    """An arrow along x that grows with a motor: this long at motor value 1, and as long the other way at 0."""

    motor: int
    length_m: float


@dataclass(frozen=True, slots=True)
class Curve:
    """A state field over time, times a factor that brings it to the unit in the name."""

    name: str
    field: str
    factor: float = 1.0


@dataclass(frozen=True, slots=True)
class Distance:
    """The distance of a part from a point, over time."""

    name: str
    to_m: Point


@dataclass(frozen=True, slots=True)
class Part:
    """Something that moves.

    Attributes:
        name: a word for it.
        shapes: seen from its own origin.
        x, y: state fields that move it; None for 0.
        turn: state field that turns it; None for 0.
        clockwise: a positive angle turns it to the right.
        on: name of the part that it is fixed to.
        fans: one for each of the controller's first sensors.
        arrow: what a motor does.
        curves: drawn beside the picture.
    """

    name: str
    shapes: tuple[Shape, ...]
    x: str | None = None
    y: str | None = None
    turn: str | None = None
    clockwise: bool = False
    on: str | None = None
    fans: tuple[Fan, ...] = ()
    arrow: Arrow | None = None
    curves: tuple[Curve, ...] | Distance = ()


@dataclass(frozen=True, slots=True)
class Swing:
    """How all trials of a generation are drawn where there is no path: a field over time, between its limits."""

    title: str
    field: str
    limit: float
    limit_text: str


@dataclass(frozen=True, slots=True)
class Phases:
    """Names of what the robot is doing: its sensors read something, they read nothing, it has reached its goal."""

    sensing: str
    blind: str
    goal: str


@dataclass(frozen=True, slots=True)
class Drawing:
    """What a robot and its surroundings look like.

    Attributes:
        title: of the picture.
        bounds_m: what it shows: left, right, bottom and top.
        fixed: shapes that stand still.
        parts: what moves; the first one's path is drawn.
        from_above: it is seen from above, so it can be shown in three dimensions too.
        swing: instead of paths, for the trials of a generation.
        phases: what the robot is doing, as a band under the picture.
        sensor_names: what people call the sensors; empty for numbers.
        motor_names: what people call the motors; empty for numbers.
    """

    title: str
    bounds_m: tuple[float, float, float, float]
    fixed: tuple[Shape, ...]
    parts: tuple[Part, ...]
    from_above: bool = False
    swing: Swing | None = None
    phases: Phases | None = None
    sensor_names: tuple[str, ...] = ()
    motor_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names = [part.name for part in self.parts]
        if len(set(names)) != len(names):
            raise ValueError(f"parts: expected different names, got {', '.join(names)}")
        for number, part in enumerate(self.parts):
            if part.on is not None and part.on not in names[:number]:
                raise ValueError(f"part {part.name}: expected it on a part before it, got {part.on!r}")

    def check(self, state_fields: tuple[str, ...]) -> None:
        """Refuse a drawing that follows fields which the body does not have.

        Raises:
            ValueError: which part follows which field, and what there is.
        """
        for part in self.parts:
            curves = () if isinstance(part.curves, Distance) else part.curves
            for field in (part.x, part.y, part.turn, *(curve.field for curve in curves)):
                if field is not None and field not in state_fields:
                    raise ValueError(
                        f"drawing: part {part.name}: expected a state field ({', '.join(state_fields)}), got {field!r}"
                    )
        if self.swing is not None and self.swing.field not in state_fields:
            raise ValueError(
                f"drawing: swing: expected a state field ({', '.join(state_fields)}), got {self.swing.field!r}"
            )


def round_robot(
    radius_m: float,
    fans: tuple[Fan, ...] = (),
    *,
    x: str = "x_m",
    y: str = "y_m",
    turn: str = "heading_rad",
    curves: tuple[Curve, ...] | Distance = (),
) -> Part:
    """A round robot with two wheels and a nose, as most small ones look from above."""
    r = radius_m
    left, right = (Strip(((-0.45 * r, side), (0.45 * r, side)), 0.34 * r, Look.WHEEL) for side in (0.95 * r, -0.95 * r))
    shapes = (Disc((0.0, 0.0), r, Look.BODY), left, right, Strip(((0.15 * r, 0.0), (r, 0.0)), 0.28 * r, Look.NOSE))
    return Part("robot", shapes, x=x, y=y, turn=turn, fans=fans, curves=curves)


def arena_walls(width_m: float, height_m: float) -> Strip:
    """The walls around the rectangle from the origin to (width, height), outside of it."""
    thick = max(width_m, height_m) / 75
    t = thick / 2
    corners = ((-t, -t), (width_m + t, -t), (width_m + t, height_m + t), (-t, height_m + t), (-t, -t))
    return Strip(corners, thick, Look.WALL)

"""What a world and the robot in it look like."""

from __future__ import annotations

import numpy as np

from backends.world.drawn import DrawnObstacle
from backends.world.layout import Motion, Senses, World
from sceann_hil.robot.drawing import (
    Block,
    Disc,
    Distance,
    Drawing,
    Fan,
    Look,
    Part,
    Shades,
    Shape,
    Strip,
    arena_walls,
    round_robot,
)

_SHADE_CELLS = 60
"""Of a picture of the floor along its longer side; the robot feels finer ones."""


def draw(world: World, senses: Senses, motion: Motion) -> Drawing:
    """Walls, obstacles, lamps, floor, target, and the robot with its sensors' fields."""
    width, height = world.arena_m
    longest = max(width, height)
    thin, margin = longest / 150, longest / 40
    fixed: list[Shape] = [arena_walls(width, height)]
    if world.floor_line is not None:
        fixed.append(Strip(world.floor_line.points_m, world.floor_line.width_m, Look.LINE))
    elif world.shades is not None:
        fixed.append(_floor(world))
    if world.goal_m is not None:
        fixed.append(Disc(world.goal_m, world.goal_radius_m, Look.TARGET))
    fixed += [Disc(it.at_m, it.radius_m, Look.OBSTACLE) for it in world.rounds]
    fixed += [Block(it.at_m, it.size_m, Look.OBSTACLE, it.angle_rad) for it in world.boxes]
    fixed += [Strip((it.from_m, it.to_m), thin, Look.WALL) for it in world.walls]
    fixed += [Disc(it.at_m, 2 * thin, Look.LAMP) for it in world.lamps]
    fans = [Fan(it.at_m, it.direction_rad, it.half_width_rad, it.range_m) for it in senses.infrared]
    fans += [Fan(at, 0.0, 0.0, 0.1 * motion.radius_m) for at in senses.ground_at_m]
    fans += [Fan(it.at_m, it.direction_rad, 0.3, 2.0 * motion.radius_m) for it in senses.light]
    toward = world.goal_m or (world.lamps[0].at_m if world.lamps else None)
    what = "target" if world.goal_m is not None else "lamp"
    curves = Distance(f"distance to the {what} [m]", toward) if toward is not None else ()
    return Drawing(
        title="Arena",
        bounds_m=(-margin, width + margin, -margin, height + margin),
        fixed=tuple(fixed),
        parts=(
            round_robot(motion.radius_m, tuple(fans), curves=curves),
            *(_drawn_part(it) for it in world.drawn_in_order),
        ),
        from_above=True,
        sensor_names=_names(senses),
        motor_names=("left", "right"),
    )


def _drawn_part(thing: DrawnObstacle) -> Part:
    """An obstacle where the state of the trial has it."""
    x, y, *turn = thing.fields
    shape: Shape
    if thing.size_m is not None:
        shape = Block((0.0, 0.0), thing.size_m, Look.OBSTACLE)
    else:
        shape = Disc((0.0, 0.0), thing.radius_m or 0.0, Look.OBSTACLE)
    return Part(f"obstacle{thing.number}", (shape,), x=x, y=y, turn=turn[0] if turn else None)


def _floor(world: World) -> Shades:
    """The floor in cells that are large enough for a picture."""
    shades = np.asarray(world.shades)
    rows, columns = (np.linspace(0, n - 1, min(n, _SHADE_CELLS)).round().astype(int) for n in shades.shape)
    return Shades(world.arena_m, tuple(map(tuple, shades[np.ix_(rows, columns)].tolist())))


def _names(senses: Senses) -> tuple[str, ...]:
    def angles(kind: str, directions: list[float]) -> list[str]:
        return [f"{kind} {np.rad2deg(a):+.0f}°" if abs(a) > 1e-9 else f"{kind} 0°" for a in directions]

    infrared = angles("ir", [it.direction_rad for it in senses.infrared])
    ground = [f"ground {number}" for number in range(len(senses.ground_at_m))]
    return (*infrared, *ground, *angles("light", [it.direction_rad for it in senses.light]))

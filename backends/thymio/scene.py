"""A twin's arena as a scene of Aseba Playground, with the robot at a trial's start."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from backends.thymio.twin import ThymioTwinConfig
from backends.world.layout import World

FLOOR = "floor.pgm"
HEIGHT_CM = 10.0
_GRID = 8
WALL_CM = 1.0
"""Thickness of an inner wall, which has none in the twin."""


def scene(twin: ThymioTwinConfig, start: Mapping[str, float], port: str = "33333") -> tuple[str, dict[str, bytes]]:
    """The text of a ``.playground`` file, and the files that it needs.

    Args:
        twin: the arena.
        start: where the robot is, by the names of the start fields; if empty, at a free place.
        port: TCP port of the robot.
    """
    world = twin.world.world(twin.arena_m, (0.0, 0.0), 0.0)
    width, height = (100.0 * length for length in twin.arena_m)
    files = {} if world.shades is None else {FLOOR: _floor(world)}
    texture = f' groundTexture="{FLOOR}"' if files else ""
    start = start or _free_place(twin)
    x, y, angle = 100.0 * start["x_m"], 100.0 * start["y_m"], start["heading_rad"]
    things = "\n".join(_things(world))
    return (
        f"""<!DOCTYPE aseba-playground>
<aseba-playground>
<color name="wall" r="0.9" g="0.9" b="0.9" />
<world w="{width:g}" h="{height:g}" color="wall"{texture} />
{things}
<robot type="thymio2" x="{x:.4f}" y="{y:.4f}" angle="{angle:.6f}" port="{port}" name="thymio" />
</aseba-playground>
""",
        files,
    )


def _free_place(twin: ThymioTwinConfig) -> Mapping[str, float]:
    """The first of a grid of places in which nothing stands, or the middle if there is none."""
    places = [
        {"x_m": x, "y_m": y, "heading_rad": 0.0}
        for y in np.linspace(0.0, twin.arena_m[1], _GRID)[1:-1].tolist()
        for x in np.linspace(0.0, twin.arena_m[0], _GRID)[1:-1].tolist()
    ]
    return next((place for place in places if not twin.refuses_start(place)), places[len(places) // 2])


def _things(world: World) -> list[str]:
    told = [
        f'<cylinder x="{100 * it.at_m[0]:g}" y="{100 * it.at_m[1]:g}" r="{100 * it.radius_m:g}" h="{HEIGHT_CM:g}" '
        'color="wall" />'
        for it in world.rounds
    ]
    boxes = [(it.at_m, it.size_m[0], it.size_m[1], it.angle_rad) for it in world.boxes]
    for wall in world.walls:
        (ax, ay), (bx, by) = wall.from_m, wall.to_m
        middle = ((ax + bx) / 2.0, (ay + by) / 2.0)
        boxes.append((middle, float(np.hypot(bx - ax, by - ay)), WALL_CM / 100.0, float(np.arctan2(by - ay, bx - ax))))
    told += [
        f'<wall x="{100 * at[0]:g}" y="{100 * at[1]:g}" l1="{100 * length:g}" l2="{100 * thick:g}" h="{HEIGHT_CM:g}" '
        f'angle="{angle:.6f}" color="wall" />'
        for at, length, thick, angle in boxes
    ]
    return told


def _floor(world: World) -> bytes:
    """The floor as a grey picture; its first row is the upper one."""
    lightness = np.round(255.0 * (1.0 - np.asarray(world.shades)))[::-1].astype(np.uint8)
    rows, columns = lightness.shape
    return f"P5\n{columns} {rows}\n255\n".encode("ascii") + lightness.tobytes()

"""A picture of where the robot has to stand before a trial, as SVG, drawn from its scenery and the trial's start."""

from __future__ import annotations

import math
from collections.abc import Mapping

from sceann_hil.robot.scenery import ArenaScenery, CartPoleScenery, Scenery

WIDTH_PX = 360


def draw_pose(scenery: Scenery | None, start: Mapping[str, float]) -> str:
    """The picture.

    Args:
        scenery: of the robot; None if it has none to draw.
        start: start values by name.
    """
    if isinstance(scenery, ArenaScenery) and {"x_m", "y_m", "heading_rad"} <= start.keys():
        return _arena(scenery, start["x_m"], start["y_m"], start["heading_rad"])
    if isinstance(scenery, CartPoleScenery) and {"x_m", "angle_rad"} <= start.keys():
        return _cart_pole(scenery, start["x_m"], start["angle_rad"])
    return _words(start)


def _svg(width: float, height: float, body: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
        f'font-family="sans-serif" font-size="14">{body}</svg>'
    )


def _arena(scenery: ArenaScenery, x_m: float, y_m: float, heading_rad: float) -> str:
    margin = 12.0
    scale = (WIDTH_PX - 2 * margin) / scenery.arena_m[0]
    height = scenery.arena_m[1] * scale + 2 * margin

    def place(at_x_m: float, at_y_m: float) -> tuple[float, float]:
        return margin + at_x_m * scale, height - margin - at_y_m * scale

    left, bottom = place(0.0, 0.0)
    target_x, target_y = place(*scenery.target_m)
    x, y = place(x_m, y_m)
    radius = scenery.body_radius_m * scale
    cones = "".join(
        _cone(x, y, heading_rad + direction, scenery.sensor_half_width_rad, 3.5 * radius)
        for direction in scenery.sensor_directions_rad
    )
    arrow = 4.0 * radius
    tip_x, tip_y = x + arrow * math.cos(heading_rad), y - arrow * math.sin(heading_rad)
    return _svg(
        WIDTH_PX,
        height,
        f'<defs><marker id="head" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="5" markerHeight="5" orient="auto">'
        f'<path d="M0 0L8 4L0 8z" fill="#c2410c"/></marker></defs>'
        f'<rect x="{left:.1f}" y="{margin}" width="{scenery.arena_m[0] * scale:.1f}" '
        f'height="{bottom - margin:.1f}" fill="#fff" stroke="#333" stroke-width="4"/>'
        f'<circle cx="{target_x:.1f}" cy="{target_y:.1f}" r="{scenery.target_radius_m * scale:.1f}" fill="#86efac" '
        f'stroke="#15803d" stroke-width="2"/>'
        f'<text x="{target_x:.1f}" y="{target_y + 5:.1f}" text-anchor="middle" fill="#14532d">goal</text>'
        f"{cones}"
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="#fed7aa" stroke="#c2410c" stroke-width="3"/>'
        f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{tip_x:.1f}" y2="{tip_y:.1f}" stroke="#c2410c" stroke-width="4" '
        f'marker-end="url(#head)"/>',
    )


def _cone(x: float, y: float, direction_rad: float, half_width_rad: float, length: float) -> str:
    corners = [
        (x + length * math.cos(angle), y - length * math.sin(angle))
        for angle in (direction_rad - half_width_rad, direction_rad + half_width_rad)
    ]
    path = " ".join(f"L{cx:.1f} {cy:.1f}" for cx, cy in corners)
    return f'<path d="M{x:.1f} {y:.1f}{path}z" fill="#94a3b8" opacity="0.25"/>'


def _cart_pole(scenery: CartPoleScenery, x_m: float, angle_rad: float) -> str:
    margin, cart_width, cart_height = 20.0, 56.0, 26.0
    scale = (WIDTH_PX - 2 * margin) / (2 * scenery.track_m)
    pole = 130.0
    track_y = margin + pole + cart_height
    x = WIDTH_PX / 2 + x_m * scale
    top = track_y - cart_height
    tip_x, tip_y = x + pole * math.sin(angle_rad), top - pole * math.cos(angle_rad)
    return _svg(
        WIDTH_PX,
        track_y + margin + 20,
        f'<line x1="{margin}" y1="{track_y}" x2="{WIDTH_PX - margin}" y2="{track_y}" stroke="#333" stroke-width="4"/>'
        f'<line x1="{WIDTH_PX / 2}" y1="{track_y}" x2="{WIDTH_PX / 2}" y2="{track_y + 8}" stroke="#333"/>'
        f'<line x1="{x:.1f}" y1="{top}" x2="{x:.1f}" y2="{top - pole}" stroke="#94a3b8" stroke-dasharray="5 5"/>'
        f'<rect x="{x - cart_width / 2:.1f}" y="{top}" width="{cart_width}" height="{cart_height}" rx="4" '
        f'fill="#fed7aa" stroke="#c2410c" stroke-width="3"/>'
        f'<line x1="{x:.1f}" y1="{top}" x2="{tip_x:.1f}" y2="{tip_y:.1f}" stroke="#c2410c" stroke-width="7" '
        f'stroke-linecap="round"/>'
        f'<text x="{WIDTH_PX / 2}" y="{track_y + 26}" text-anchor="middle">pole at {math.degrees(angle_rad):+.1f}°, '
        f"cart at {x_m:+.2f} m</text>",
    )


def _words(start: Mapping[str, float]) -> str:
    lines = "".join(
        f'<text x="12" y="{28 + 22 * i}">{name} = {value:.4g}</text>' for i, (name, value) in enumerate(start.items())
    )
    return _svg(WIDTH_PX, 28 + 22 * max(1, len(start)), lines)

"""A picture of where the robot has to stand before a trial, as SVG, from its drawing and the trial's start."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

from sceann_hil.robot.drawing import Block, Disc, Drawing, Fan, Look, Part, Shades, Shape, Strip

WIDTH_PX = 360
_MARGIN = 12.0
_LONGEST_FAN_PX = 90.0
_COLOURS = {
    Look.WALL: "#333333",
    Look.OBSTACLE: "#94a3b8",
    Look.TARGET: "#86efac",
    Look.LAMP: "#fde047",
    Look.LINE: "#111827",
    Look.MARK: "#94a3b8",
    Look.LIMIT: "#e5e7eb",
    Look.BODY: "#fed7aa",
    Look.NOSE: "#c2410c",
    Look.WHEEL: "#64748b",
    Look.CART: "#fed7aa",
    Look.TIP: "#c2410c",
}
_WORDS = {Look.TARGET: "goal", Look.LAMP: "lamp"}


def draw_pose(drawing: Drawing | None, start: Mapping[str, float]) -> str:
    """The picture; in words where there is nothing to draw, or where the start does not say where the parts are.

    Args:
        drawing: of the robot; None if it has none.
        start: start values by name.
    """
    if drawing is None or not any(field in start for part in drawing.parts for field in (part.x, part.y, part.turn)):
        return _words(start)
    left, right, bottom, top = drawing.bounds_m
    scale = (WIDTH_PX - 2 * _MARGIN) / (right - left)
    height = (top - bottom) * scale + 2 * _MARGIN
    paper = _Paper(complex(_MARGIN - left * scale, height - _MARGIN + bottom * scale), scale)
    shapes = "".join(paper.shape(shape, _Pose()) for shape in drawing.fixed)
    poses: dict[str, _Pose] = {}
    for number, part in enumerate(drawing.parts):
        moved_by = {field for field in (part.x, part.y, part.turn) if field is not None}
        if moved_by and not moved_by & start.keys():
            continue  # nobody knows yet where it will be, such as an obstacle that is drawn when the trial begins
        pose = poses[part.name] = _pose(part, start, poses.get(part.on or "", _Pose()))
        shapes += "".join(paper.fan(fan, pose) for fan in part.fans)
        shapes += "".join(paper.shape(shape, pose) for shape in part.shapes)
        if drawing.from_above and part.turn is not None and number == 0:
            shapes += paper.arrow(pose, 0.12 * (right - left))
    return _svg(WIDTH_PX, height, shapes)


@dataclass(frozen=True, slots=True)
class _Pose:
    """Where a part's origin is, and how far it is turned."""

    at_m: complex = 0j
    angle_rad: float = 0.0

    def place(self, point: complex) -> complex:
        return self.at_m + cmath.exp(1j * self.angle_rad) * point


def _pose(part: Part, start: Mapping[str, float], on: _Pose) -> _Pose:
    place = complex(start.get(part.x or "", 0.0), start.get(part.y or "", 0.0))
    turn = start.get(part.turn or "", 0.0)
    return _Pose(on.place(place), on.angle_rad + (-turn if part.clockwise else turn))


@dataclass(frozen=True, slots=True)
class _Paper:
    """From metres to pixels: where the origin is, and pixels per metre."""

    origin: complex
    scale: float

    def at(self, point: complex) -> complex:
        return self.origin + complex(point.real, -point.imag) * self.scale

    def shape(self, shape: Shape, pose: _Pose) -> str:
        match shape:
            case Disc():
                at, radius = self.at(pose.place(complex(*shape.at_m))), shape.radius_m * self.scale
                disc = (
                    f'<circle cx="{at.real:.1f}" cy="{at.imag:.1f}" r="{radius:.1f}" fill="{_COLOURS[shape.look]}" '
                    f'stroke="#475569" stroke-width="1"/>'
                )
                word = _WORDS.get(shape.look, "")
                text = (
                    f'<text x="{at.real:.1f}" y="{at.imag + 5:.1f}" text-anchor="middle" fill="#14532d">{word}</text>'
                )
                return disc + (text if word else "")
            case Strip():
                points = " ".join(_xy(self.at(pose.place(complex(*point)))) for point in shape.points_m)
                width = max(shape.width_m * self.scale, 1.0)
                colour = _COLOURS[shape.look]
                return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width:.1f}"/>'
            case Block():
                half = complex(*shape.size_m) / 2
                turn = cmath.exp(1j * shape.angle_rad)
                corners = (half, -half.conjugate(), -half, half.conjugate())
                points = " ".join(_xy(self.at(pose.place(complex(*shape.at_m) + turn * corner))) for corner in corners)
                return f'<polygon points="{points}" fill="{_COLOURS[shape.look]}" stroke="#475569" stroke-width="1"/>'
            case Shades():
                return self._shades(shape)

    def _shades(self, shape: Shades) -> str:
        rows, columns = len(shape.rows), len(shape.rows[0])
        width, height = shape.size_m[0] / columns * self.scale, shape.size_m[1] / rows * self.scale
        cells = ""
        for number, row in enumerate(shape.rows):
            for column, dark in enumerate(row):
                if dark > 0.0:
                    at = self.at(complex(column * shape.size_m[0] / columns, (number + 1) * shape.size_m[1] / rows))
                    cells += (
                        f'<rect x="{at.real:.1f}" y="{at.imag:.1f}" width="{width:.1f}" height="{height:.1f}" '
                        f'fill="#111827" opacity="{dark:.2f}"/>'
                    )
        return cells

    def fan(self, fan: Fan, pose: _Pose) -> str:
        """A sensor's field, as far as it reaches but not so far that it hides the picture."""
        reach = min(fan.reach_m, _LONGEST_FAN_PX / self.scale)
        begin = complex(*fan.at_m)
        ends = (begin + cmath.rect(reach, fan.direction_rad + s * max(fan.half_width_rad, 0.02)) for s in (-1.0, 1.0))
        path = " ".join(f"L{_xy(self.at(pose.place(end)))}" for end in ends)
        return f'<path d="M{_xy(self.at(pose.place(begin)))}{path}z" fill="#94a3b8" opacity="0.25"/>'

    def arrow(self, pose: _Pose, length_m: float) -> str:
        """Where the robot looks."""
        tail, tip = self.at(pose.at_m), self.at(pose.place(complex(length_m, 0.0)))
        back = (tail - tip) / abs(tail - tip) * 9.0
        head = " ".join(_xy(tip + back * cmath.exp(1j * s)) for s in (0.45, -0.45))
        return (
            f'<line x1="{tail.real:.1f}" y1="{tail.imag:.1f}" x2="{tip.real:.1f}" y2="{tip.imag:.1f}" '
            f'stroke="#c2410c" stroke-width="3"/><polygon points="{_xy(tip)} {head}" fill="#c2410c"/>'
        )


def _xy(point: complex) -> str:
    return f"{point.real:.1f},{point.imag:.1f}"


def _svg(width: float, height: float, body: str) -> str:
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" role="img" '
        f'font-family="sans-serif" font-size="14">{body}</svg>'
    )


def _words(start: Mapping[str, float]) -> str:
    lines = "".join(
        f'<text x="12" y="{28 + 22 * i}">{escape(_said(name, value))}</text>'
        for i, (name, value) in enumerate(start.items())
    )
    return _svg(WIDTH_PX, 28 + 22 * max(1, len(start)), lines)


def _said(name: str, value: float) -> str:
    if name.endswith("_rad"):
        return f"{name.removesuffix('_rad')}: {math.degrees(value):.1f}°"
    return f"{name} = {value:.4g}"

"""A robot's drawing as a Matplotlib picture: what stands still, and the robot in some of its poses."""

from __future__ import annotations

import cmath
from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from sceann_hil.robot.drawing import Block, Disc, Drawing, Look, Part, Shades, Shape
from sceann_hil.study.style import BLUE, DARK, GREY, LIGHT, ORANGE

_FILL = {
    Look.WALL: DARK,
    Look.OBSTACLE: GREY,
    Look.TARGET: "#fee0b6",
    Look.LAMP: "#ffe873",
    Look.LINE: DARK,
    Look.BODY: "#d1e5f0",
    Look.CART: "#d1e5f0",
    Look.NOSE: BLUE,
}


def draw_surroundings(axes: Axes, drawing: Drawing) -> None:
    """What stands still, to scale, with the view that the drawing asks for."""
    for shape in drawing.fixed:
        _draw(axes, shape, 0j, 0.0, 1.0, 0)
    left, right, bottom, top = drawing.bounds_m
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    axes.set_aspect("equal")


def draw_part(axes: Axes, part: Part, state: Mapping[str, float], alpha: float) -> None:
    """A part where this state has it; `state` gives values by the names of the state fields."""
    _shapes(axes, part, *_placed(part, state, (0j, 0.0)), alpha)


def draw_robot(axes: Axes, drawing: Drawing, state: Mapping[str, float], alpha: float) -> None:
    """All parts where this state has them, those on others with them; parts of which it tells nothing are left out."""
    places: dict[str, tuple[complex, float]] = {}
    for part in drawing.parts:
        at, turn = places[part.name] = _placed(part, state, places.get(part.on or "", (0j, 0.0)))
        moved_by = {field for field in (part.x, part.y, part.turn) if field is not None}
        if not moved_by or moved_by & state.keys():
            _shapes(axes, part, at, turn, alpha)


def _placed(part: Part, state: Mapping[str, float], on: tuple[complex, float]) -> tuple[complex, float]:
    place = complex(state.get(part.x or "", 0.0), state.get(part.y or "", 0.0))
    turn = state.get(part.turn or "", 0.0)
    return on[0] + cmath.exp(1j * on[1]) * place, on[1] + (-turn if part.clockwise else turn)


def _shapes(axes: Axes, part: Part, at: complex, turn: float, alpha: float) -> None:
    for shape in part.shapes:
        if getattr(shape, "look", None) is not Look.WHEEL:
            _draw(axes, shape, at, turn, alpha, 1)


def draw_others(axes: Axes, drawing: Drawing, state: Mapping[str, float]) -> None:
    """What one trial has at a place of its own besides the robot, such as an obstacle that was drawn for it."""
    for part in drawing.parts[1:]:
        if part.on is None:
            draw_part(axes, part, state, 0.9)


def _draw(axes: Axes, shape: Shape, at: complex, turn: float, alpha: float, order: int) -> None:
    def placed(point: tuple[float, float]) -> complex:
        return at + cmath.exp(1j * turn) * complex(*point)

    if isinstance(shape, Shades):
        extent = (0.0, shape.size_m[0], 0.0, shape.size_m[1])
        axes.imshow(np.array(shape.rows), cmap="Greys", vmin=0, vmax=2, origin="lower", extent=extent, zorder=-1)
        return
    colour = _FILL.get(shape.look, LIGHT)
    edge = ORANGE if shape.look is Look.TARGET else BLUE if order else colour
    if isinstance(shape, Disc):
        centre = placed(shape.at_m)
        disc = Circle((centre.real, centre.imag), shape.radius_m, facecolor=colour, edgecolor=edge, linewidth=0.8)
        disc.set(alpha=alpha, zorder=order)
        axes.add_patch(disc)
    elif isinstance(shape, Block):
        half = np.array(shape.size_m) / 2
        signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
        corners = (complex(*shape.at_m) + np.exp(1j * shape.angle_rad) * complex(*(half * sign)) for sign in signs)
        points = [placed((corner.real, corner.imag)) for corner in corners]
        patch = Polygon([(p.real, p.imag) for p in points], facecolor=colour, edgecolor=edge, linewidth=0.8)
        patch.set(alpha=alpha, zorder=order)
        axes.add_patch(patch)
    else:
        points = [placed(point) for point in shape.points_m]
        axes.plot([p.real for p in points], [p.imag for p in points], color=colour, alpha=alpha, zorder=order, lw=1.4)

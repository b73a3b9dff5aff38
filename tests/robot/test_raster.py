"""Drawings in characters: everything where it is, in its proportions, with what every terminal can show."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sceann_hil.robot.drawing import Block, Disc, Drawing, Look, Part, Shades, Shape, Strip
from sceann_hil.robot.raster import Raster, pose_of

NOSE = Strip(((0.0, 0.0), (0.2, 0.0)), 0.02, Look.NOSE)


def drawing(*fixed: Shape, parts: tuple[Part, ...] = ()) -> Drawing:
    """Two metres wide and one high."""
    return Drawing("Arena", (0.0, 2.0, 0.0, 1.0), fixed, parts)


def looks(raster: Raster, look: Look | None) -> list[tuple[int, int]]:
    """Row and column of every character with a piece of such a thing."""
    return [
        (row, column)
        for row, line in enumerate(raster.lines())
        for column, cell in enumerate(line)
        if cell.text != " " and cell.look is look
    ]


@pytest.mark.parametrize(("columns", "rows", "used"), [(40, 40, (40, 10)), (80, 10, (40, 10)), (200, 1, (4, 1))])
def test_a_picture_keeps_its_proportions(columns: int, rows: int, used: tuple[int, int]) -> None:
    raster = Raster(drawing(), columns, rows)
    assert (raster.columns, raster.rows) == used
    assert [len(line) for line in raster.lines()] == [used[0]] * used[1]


@pytest.mark.parametrize(
    ("shape", "places"),
    [
        (Disc((0.1, 0.9), 0.02, Look.TARGET), {(0, 1), (0, 2)}),
        (Disc((1.9, 0.1), 0.02, Look.LAMP), {(9, 37), (9, 38)}),
        (Strip(((0.0, 0.05), (1.99, 0.05)), 0.02, Look.LINE), {(9, column) for column in range(40)}),
        (Block((1.0, 0.5), (0.1, 0.9), Look.OBSTACLE), {(row, column) for row in range(10) for column in (19, 21)}),
        (Shades((2.0, 1.0), ((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 0.0))), {(7, column) for column in range(32, 38)}),
    ],
)
def test_what_stands_still_is_where_it_is(shape: Shape, places: set[tuple[int, int]]) -> None:
    look = shape.look if not isinstance(shape, Shades) else Look.LINE
    assert (
        places
        <= set(looks(Raster(drawing(shape), 40, 10), look))
        <= {(row + up, column + left) for row, column in places for up in (-1, 0, 1) for left in (-1, 0, 1)}
    )


@pytest.mark.parametrize(("heading_rad", "toward"), [(0.0, (5, 23)), (math.pi / 2, (3, 20)), (math.pi, (5, 16))])
def test_what_moves_is_turned_as_it_is(heading_rad: float, toward: tuple[int, int]) -> None:
    part = Part("robot", (NOSE,), x="x_m", y="y_m", turn="heading_rad")
    raster = Raster(drawing(parts=(part,)), 40, 10)
    raster.parts({"x_m": 1.0, "y_m": 0.49, "heading_rad": heading_rad})
    assert toward in looks(raster, Look.NOSE)


def test_a_part_goes_with_the_part_that_it_is_fixed_to() -> None:
    cart = Part("cart", (), x="x_m")
    pole = Part("pole", (NOSE,), turn="angle_rad", clockwise=True, on="cart")
    pose = pose_of(drawing(parts=(cart, pole)), pole, {"x_m": 0.7, "angle_rad": 0.25})
    assert (pose.x_m, pose.y_m, pose.angle_rad) == (0.7, 0.0, -0.25)


def test_a_path_is_drawn_and_what_lies_outside_is_cut_off() -> None:
    raster = Raster(drawing(), 40, 10)
    raster.path(np.array([[-5.0, 0.5], [0.1, 0.5], [9.0, 0.5]]))
    assert looks(raster, None) == [(5, column) for column in range(40)]


def test_terminals_without_braille_get_plain_signs() -> None:
    raster = Raster(drawing(Disc((0.5, 0.5), 0.2, Look.TARGET), Disc((1.5, 0.5), 0.1, Look.MARK)), 40, 10)
    raster.path(np.array([[0.0, 0.05], [2.0, 0.05]]))
    text = "".join(cell.text for line in raster.lines(braille=False) for cell in line)
    assert set(text) == {" ", "G", "."}
    assert text.isascii()

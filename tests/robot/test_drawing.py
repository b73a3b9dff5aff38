"""The vocabulary of drawings: what it refuses, where parts are, and that every simulated robot can be drawn."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from itertools import pairwise

import numpy as np
import pytest

from backends.cartpole import CartPole
from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from sceann_hil.recording import scene
from sceann_hil.robot import Robot
from sceann_hil.robot.drawing import (
    Block,
    Curve,
    Disc,
    Drawing,
    Fan,
    Look,
    Part,
    Shades,
    Strip,
    arena_walls,
    round_robot,
)
from sceann_hil.supervision.operators.web.pose import draw_pose

WORLD = DifferentialDriveConfig.model_validate(
    {
        "arena_m": (1.0, 0.8),
        "world": {
            "infrared": ({"direction_deg": 0.0},),
            "ground": ({"at_m": (0.02, 0.0)},),
            "light": ({"direction_deg": 30.0},),
            "obstacles": ({"at_m": (0.3, 0.3), "radius_m": 0.1}, {"at_m": (0.6, 0.5), "size_m": (0.1, 0.2)}),
            "lamps": ({"at_m": (0.9, 0.7)},),
            "shades": ((0.0, 1.0), (0.5, 0.0)),
        },
    }
)


@pytest.mark.parametrize(
    "robot",
    [CartPole(), DifferentialDrive(DifferentialDriveConfig(n_sensors=5)), WORLD.build()],
)
def test_every_simulated_robot_draws_what_its_body_has(robot: Robot) -> None:
    assert robot.drawing is not None
    robot.drawing.check(robot.spec.state_fields)
    assert len(robot.drawing.sensor_names) >= robot.spec.n_sensors


def test_a_part_that_follows_no_state_field_is_named() -> None:
    drawing = Drawing("x", (0.0, 1.0, 0.0, 1.0), (), (Part("arm", (), turn="elbow_rad"),))
    with pytest.raises(ValueError, match=r"part arm: expected a state field \(x_m\), got 'elbow_rad'"):
        drawing.check(("x_m",))
    curved = Drawing("x", (0.0, 1.0, 0.0, 1.0), (), (Part("arm", (), curves=(Curve("a", "b"),)),))
    with pytest.raises(ValueError, match="got 'b'"):
        curved.check(("x_m",))


def test_parts_have_names_of_their_own_and_hang_on_parts_before_them() -> None:
    with pytest.raises(ValueError, match="different names"):
        Drawing("x", (0.0, 1.0, 0.0, 1.0), (), (Part("a", ()), Part("a", ())))
    with pytest.raises(ValueError, match="expected it on a part before it"):
        Drawing("x", (0.0, 1.0, 0.0, 1.0), (), (Part("a", (), on="b"), Part("b", ())))


def test_a_part_on_another_one_moves_with_it() -> None:
    arm = Drawing("x", (0.0, 1.0, 0.0, 1.0), (), (Part("base", ()), Part("arm", (), on="base")))
    assert scene.entity(arm, arm.parts[1]) == "/scene/base/arm"


def test_a_rectangle_is_filled_to_its_corners() -> None:
    block = Block((0.5, 0.5), (0.1, 0.4), Look.OBSTACLE, 0.3)
    strips = scene.filling(block)
    points = np.array([point for strip in strips for point in strip.points_m])
    turned = np.exp(-1j * block.angle_rad) * (points @ [1, 1j] - complex(*block.at_m))
    edge = strips[0].width_m / 1.2 / 2
    assert np.abs(turned.real).max() + edge == pytest.approx(0.05)
    assert np.abs(turned.imag).max() + edge == pytest.approx(0.2)
    assert all(a.width_m == b.width_m for a, b in pairwise(strips))


def test_the_start_pose_is_well_formed_and_to_scale() -> None:
    text = draw_pose(WORLD.build().drawing, {"x_m": 0.5, "y_m": 0.2, "heading_rad": 0.0})
    ElementTree.fromstring(text)
    discs = [tuple(map(float, disc)) for disc in re.findall(r'<circle cx="(\S+)" cy="(\S+)" r="(\S+)"', text)]
    obstacle, lamp, body = discs
    per_m = obstacle[2] / 0.1
    assert (body[0] - obstacle[0]) / per_m == pytest.approx(0.2, abs=0.01)
    assert (body[1] - obstacle[1]) / per_m == pytest.approx(0.1, abs=0.01)
    assert lamp[1] < obstacle[1]


def test_a_fan_is_as_long_as_its_sensor_reaches() -> None:
    def length_px(reach_m: float) -> float:
        part = Part("robot", (), x="x_m", y="y_m", turn="heading_rad", fans=(Fan((0.0, 0.0), 0.0, 0.1, reach_m),))
        text = draw_pose(Drawing("it", (0.0, 1.0, 0.0, 1.0), (), (part,)), {"x_m": 0.5, "y_m": 0.5, "heading_rad": 0.0})
        numbers = re.findall(r'<path d="M(\S+),(\S+)L(\S+),(\S+) L', text)[0]
        x0, y0, x1, y1 = map(float, numbers)
        return float(np.hypot(x1 - x0, y1 - y0))

    assert length_px(0.2) == pytest.approx(2 * length_px(0.1), abs=0.2)
    assert length_px(5.0) < 100.0


def test_a_pole_leans_to_the_right_of_its_cart() -> None:
    text = draw_pose(CartPole().drawing, {"x_m": 0.0, "velocity_m_s": 0.0, "angle_rad": 0.5})
    ElementTree.fromstring(text)
    rod = re.findall(r'<polyline points="(\S+),(\S+) (\S+),(\S+)"', text)[-1]
    x0, y0, x1, y1 = map(float, rod)
    assert x1 > x0
    assert y1 < y0


def test_what_cannot_be_drawn_is_said_in_words_that_are_text() -> None:
    text = draw_pose(None, {"<b>x</b>": 1.0, "angle_rad": np.pi / 2})
    ElementTree.fromstring(text)
    assert "&lt;b&gt;x" in text
    assert "angle: 90.0°" in text


def test_shapes_of_a_robot_of_ones_own() -> None:
    robot = round_robot(0.05, x="px", y="py", turn="yaw")
    drawing = Drawing(
        "Hall", (0.0, 2.0, 0.0, 1.0), (arena_walls(2.0, 1.0), Shades((2.0, 1.0), ((0.0,),))), (robot,), from_above=True
    )
    drawing.check(("px", "py", "yaw"))
    assert isinstance(robot.shapes[0], Disc)
    assert isinstance(drawing.fixed[0], Strip)

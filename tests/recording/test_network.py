"""The drawn network is the network."""

from __future__ import annotations

import numpy as np
import pytest

from sceann_hil.network.coding import NetworkSize
from sceann_hil.recording import network
from sceann_hil.robot.drawing import Drawing, Fan, Part
from sceann_hil.robot.signal_names import sensor_names, sensors_from_left
from tests.runs import GOAL, config_of

SIZES = [NetworkSize(1, 0, 1), NetworkSize(7, 2, 2), NetworkSize(2, 5, 1), NetworkSize(4, 17, 2)]


def plain(size: NetworkSize) -> tuple[int, ...]:
    """Sensors in the controller's order."""
    return tuple(range(size.n_sensors))


def visible_parts(weights: np.ndarray, size: NetworkSize) -> tuple[np.ndarray, np.ndarray]:
    """For every possible connection, how many excitatory and how many inhibitory strips are seen."""
    lines = network._lines(size, plain(size))
    drawn = network.connections(weights, size, plain(size))
    seen = ~np.isnan(drawn.radii.as_arrow_array().to_numpy())
    count = size.n_neurons * size.n_sources
    return tuple(np.bincount(lines.connection[seen & (lines.sign == sign)], minlength=count) for sign in (1, -1))


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_exactly_the_connections_that_are_there_are_seen_with_their_sign(size: NetworkSize) -> None:
    rng = np.random.default_rng(1)
    weights = rng.integers(-1, 2, (size.n_neurons, size.n_sources)).astype(np.int8)
    excitatory, inhibitory = visible_parts(weights, size)
    flat = weights.reshape(-1)
    assert np.array_equal(excitatory > 0, flat == 1)
    assert np.array_equal(inhibitory > 0, flat == -1)


def test_excitatory_lines_are_whole_and_inhibitory_lines_are_dashed() -> None:
    size = NetworkSize(7, 2, 2)
    excitatory, _ = visible_parts(np.ones((4, 11), np.int8), size)
    _, inhibitory = visible_parts(-np.ones((4, 11), np.int8), size)
    assert (excitatory == 2).all()  # the line and its arrow head
    assert (inhibitory > 3).all()


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_arrows_lead_from_the_source_to_the_neuron(size: NetworkSize) -> None:
    places = network.layout(size, plain(size))
    for neuron, row in enumerate(network._curves(size, plain(size))):
        for source, (curve, head) in enumerate(row):
            target = size.n_sensors + neuron
            to_start = np.linalg.norm(places - curve[0], axis=1)
            to_tip = np.linalg.norm(places - head[1], axis=1)
            assert to_start.argmin() == source
            assert to_tip.argmin() == target


def test_opposite_connections_do_not_coincide() -> None:
    size = NetworkSize(2, 3, 2)
    curves = network._curves(size, plain(size))
    for a in range(size.n_neurons):
        for b in range(a):
            there = curves[a][size.n_sensors + b][0]
            back = curves[b][size.n_sensors + a][0]
            middle_there, middle_back = there[len(there) // 2], back[len(back) // 2]
            assert np.linalg.norm(middle_there - middle_back) > 0.2


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_every_node_has_a_place_of_its_own_inside_the_view(size: NetworkSize) -> None:
    places = network.layout(size, plain(size))
    (left, right), (top, bottom) = network.BOUNDS
    assert ((places > [left, top]) & (places < [right, bottom])).all()
    apart = np.linalg.norm(places[:, None] - places, axis=-1) + 9.0 * np.eye(len(places))
    assert apart.min() > 0.4


def test_the_robot_s_left_is_on_top_for_sensors_and_motors() -> None:
    robot = config_of(GOAL).robot
    size = config_of(GOAL).size
    names, order = sensor_names(size, robot.build().drawing), sensors_from_left(size, robot.build().drawing)
    places = network.layout(size, order)
    from_top = [names[k] for k in np.argsort(places[: size.n_sensors, 1])]  # y points down
    assert from_top == ["+40°", "0°", "-40°"]
    left, right = places[-2:, 1]
    assert left < right


def test_kinds_of_sensors_stay_apart_and_unknown_ones_come_last() -> None:
    infrared = [Fan((0.0, 0.0), angle, 0.2, 1.0) for angle in (-0.5, 0.0, 0.5)]
    ground = [Fan((0.1, y_m), 0.0, 0.0, 0.01) for y_m in (-0.02, 0.02)]
    drawing = Drawing("Robot", (0.0, 1.0, 0.0, 1.0), (), (Part("robot", (), fans=(*infrared, *ground)),))
    assert sensors_from_left(NetworkSize(7, 1, 2), drawing) == (2, 1, 0, 4, 3, 5, 6)
    assert sensors_from_left(NetworkSize(2, 1, 2), drawing) == (1, 0)
    assert sensors_from_left(NetworkSize(2, 1, 2), None) == (0, 1)

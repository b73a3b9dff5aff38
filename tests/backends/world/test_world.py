"""The robot in a world against plain geometry: readings by marching along their rays, steps by their definition."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from backends.diffdrive import DifferentialDriveConfig
from backends.world.body import WorldDrive
from backends.world.layout import Box, Infrared, Lamp, Light, Motion, Round, Senses, Wall, World
from backends.world.response import fitted
from sceann_hil.network.controller import quantise_sensors
from sceann_hil.robot import EndReason, Trace
from tests.backends.conftest import MakeTrials

ARENA = (1.0, 0.8)
RADIUS = 0.03
THINGS = World(
    ARENA,
    rounds=(Round((0.25, 0.5), 0.06), Round((0.8, 0.2), 0.1)),
    boxes=(Box((0.6, 0.55), (0.2, 0.1), 0.5),),
    walls=(Wall((0.4, 0.1), (0.5, 0.35)),),
)
SENSORS = tuple(
    Infrared((RADIUS * np.cos(a), RADIUS * np.sin(a)), float(a), 0.3)
    for a in np.deg2rad([-90.0, -45.0, 0.0, 45.0, 90.0])
)
MOTION = Motion(step_m=0.02, radius_m=RADIUS, wheel_interval_m=0.05)


def inside(world: World, x: NDArray[np.float64], y: NDArray[np.float64], grown_m: float = 0.0) -> NDArray[np.bool_]:
    """Where a point, or a disc of radius `grown_m`, touches something; the plain definition of every shape."""
    met = (x < grown_m) | (x > world.arena_m[0] - grown_m) | (y < grown_m) | (y > world.arena_m[1] - grown_m)
    for it in world.rounds:
        met |= np.hypot(x - it.at_m[0], y - it.at_m[1]) < it.radius_m + grown_m
    for box in world.boxes:
        turn = np.exp(-1j * box.angle_rad) * (x - box.at_m[0] + 1j * (y - box.at_m[1]))
        out_x, out_y = np.abs(turn.real) - box.size_m[0] / 2, np.abs(turn.imag) - box.size_m[1] / 2
        met |= np.hypot(np.maximum(out_x, 0), np.maximum(out_y, 0)) + np.minimum(np.maximum(out_x, out_y), 0) < grown_m
    for wall in world.walls:
        a, b = complex(*wall.from_m), complex(*wall.to_m)
        part = np.clip(((x + 1j * y - a) / (b - a)).real, 0, 1)
        # a thin wall: marching in steps of 0.2 mm must not jump over it
        met |= np.abs(x + 1j * y - a - part * (b - a)) < max(grown_m, 1.1e-4)
    return np.asarray(met)


def marched(world: World, sensor: Infrared, state: NDArray[np.float32]) -> NDArray[np.float64]:
    """Distance along a sensor's ray until it is inside something, for each state, to 0.2 mm."""
    place = (state[:, 0] + 1j * state[:, 1]) + np.exp(1j * state[:, 2]) * complex(*sensor.at_m)
    along = np.exp(1j * (state[:, 2] + sensor.direction_rad))
    way = np.arange(0.0, sensor.range_m, 2e-4)
    points = place[:, None] + along[:, None] * way
    met = inside(world, points.real, points.imag)
    return np.where(met.any(axis=1), way[met.argmax(axis=1)], sensor.range_m)


def traces_of(robot: WorldDrive, make_trials: MakeTrials, n: int = 40, start: object = (0.5, 0.45, 0.6)) -> list[Trace]:
    traces = robot.trace(make_trials(robot, n, start=start, max_steps=150)).traces
    assert traces is not None
    return list(traces)


def test_infrared_reads_the_distance_to_whatever_is_nearest(make_trials: MakeTrials) -> None:
    robot = WorldDrive(THINGS, Senses(SENSORS), MOTION, 0.1)
    errors, readings = [], []
    for trace in traces_of(robot, make_trials, 12):
        for number, sensor in enumerate(SENSORS):
            state = trace.state[:-1].astype(float)
            reading = 1.0 - marched(THINGS, sensor, state) / sensor.range_m
            readings.append(reading)
            errors.append(np.abs(trace.sensors[:, number] / 1023.0 - reading))
    # a grazing ray may miss by a hair what marching meets
    assert np.mean(np.concatenate(errors) > 2e-3) < 0.005
    assert np.mean(np.concatenate(readings) > 0.0) > 0.2


@pytest.mark.parametrize("degrees", [0.0, 90.0, 180.0, 270.0, 45.0])
def test_a_ray_along_the_arena_s_walls_meets_what_is_ahead_and_nothing_else(
    degrees: float, make_trials: MakeTrials
) -> None:
    """Regression: a sensor that looked exactly along a wall read contact, as in starts at 0 and 180 degrees."""
    sensor = Infrared((RADIUS, 0.0), 0.0, 0.45)
    robot = WorldDrive(World(ARENA), Senses((sensor,)), MOTION, 0.1)
    (trace,) = traces_of(robot, make_trials, 1, start=(0.5, 0.4, np.deg2rad(degrees)))
    expected = 1.0 - marched(World(ARENA), sensor, trace.state[:1].astype(float)) / sensor.range_m
    assert trace.sensors[0, 0] / 1023.0 == pytest.approx(expected[0], abs=2e-3)


def test_a_table_of_readings_gives_what_the_straight_response_gives(make_trials: MakeTrials) -> None:
    table = fitted(((0.0, 1.0), (0.3, 0.0)), 0.3)
    sensors = (Infrared((0.03, 0.0), 0.2, 0.3), Infrared((0.03, 0.0), 0.2, 0.3, table))
    robot = WorldDrive(THINGS, Senses(sensors), MOTION, 0.1)
    for trace in traces_of(robot, make_trials, 10):
        assert np.abs(trace.sensors[:, 0].astype(int) - trace.sensors[:, 1]).max() <= 1


def test_a_sensor_with_an_opening_reads_the_mean_of_its_rays(make_trials: MakeTrials) -> None:
    wide = Infrared((0.03, 0.0), 0.1, 0.3, half_width_rad=0.3, rays=3)
    parts = [Infrared((0.03, 0.0), 0.1 + turn, 0.3) for turn in (-0.2, 0.0, 0.2)]
    robot = WorldDrive(THINGS, Senses((wide, *parts)), MOTION, 0.1)
    for trace in traces_of(robot, make_trials, 10):
        assert np.abs(trace.sensors[:, 0] - trace.sensors[:, 1:].mean(axis=1)).max() <= 1.0


def test_the_body_never_stands_in_anything(make_trials: MakeTrials) -> None:
    robot = WorldDrive(THINGS, Senses(SENSORS), MOTION, 0.1)
    touched = 0
    for trace in traces_of(robot, make_trials, 60):
        x, y = trace.state[:, 0].astype(float), trace.state[:, 1].astype(float)
        assert not inside(THINGS, x, y, RADIUS - 1e-5).any()
        touched += int(inside(THINGS, x, y, RADIUS + 1e-5).sum())
    assert touched > 100


def test_a_bump_may_end_the_trial(make_trials: MakeTrials) -> None:
    motion = Motion(0.02, RADIUS, 0.05, bump_ends=True)
    robot = WorldDrive(THINGS, Senses(SENSORS), motion, 0.1)
    results = robot.trace(make_trials(robot, 60, start=(0.5, 0.45, 0.6), max_steps=150))
    assert results.traces is not None
    ended = results.end_reasons == EndReason.OUT_OF_BOUNDS
    assert 5 < ended.sum() < 60
    for end, trace in zip(ended, results.traces, strict=True):
        x, y = trace.state[1:, 0].astype(float), trace.state[1:, 1].astype(float)
        touching = inside(THINGS, x, y, RADIUS + 1e-6)
        assert not touching[:-1].any()
        assert touching[-1] == end


@pytest.mark.parametrize(("backwards", "rest"), [(True, 0.5), (False, 0.0)])
def test_motor_values_move_the_wheels(backwards: bool, rest: float, make_trials: MakeTrials) -> None:
    motion = Motion(0.02, RADIUS, 0.05, backwards=backwards)
    robot = WorldDrive(World((100.0, 100.0)), Senses(SENSORS), motion, 0.1)
    assert robot.neutral_motor == rest
    for trace in traces_of(robot, make_trials, 10, (50.0, 50.0, 0.6)):
        left, right = (0.02 * (trace.x[:, -2:] / 1024.0 - rest) / (1.0 - rest)).T
        heading = trace.state[:-1, 2].astype(float)
        step = np.diff(trace.state.astype(float), axis=0)
        forward = (left + right) / 2
        assert np.abs(step[:, 0] - forward * np.cos(heading)).max() < 2e-5
        assert np.abs(step[:, 1] - forward * np.sin(heading)).max() < 2e-5
        turn = (step[:, 2] - (right - left) / 0.05 + np.pi) % (2 * np.pi) - np.pi
        assert np.abs(turn).max() < 1e-5


def test_light_falls_with_distance_angle_and_shadow(make_trials: MakeTrials) -> None:
    lamps = (Lamp((0.9, 0.7), 0.2), Lamp((0.05, 0.05), 0.1))
    world = World(ARENA, THINGS.rounds, THINGS.boxes, THINGS.walls, lamps)
    sensors = tuple(Light((0.0, 0.0), float(a)) for a in np.deg2rad([-60.0, 0.0, 60.0]))
    robot = WorldDrive(world, Senses(light=sensors), MOTION, 0.1)
    shadowed = 0
    errors = []
    for trace in traces_of(robot, make_trials, 8):
        x, y, heading = trace.state[:-1].astype(float).T
        for number, sensor in enumerate(sensors):
            expected = np.zeros(len(x))
            for lamp in lamps:
                to = complex(*lamp.at_m) - (x + 1j * y)
                facing = np.cos(np.angle(to) - heading - sensor.direction_rad)
                steps = np.linspace(0.0, 1.0, 1500)
                points = (x + 1j * y)[:, None] + to[:, None] * steps
                dark = inside(world, points.real, points.imag).any(axis=1)
                shadowed += int(dark.sum())
                bright = np.minimum((lamp.reference_m / np.abs(to)) ** 2, 1.0) * np.maximum(facing, 0.0)
                expected += np.where(dark, 0.0, bright)
            errors.append(np.abs(trace.sensors[:, number].astype(int) - quantise_sensors(np.minimum(expected, 1.0))))
    assert np.mean(np.concatenate(errors) > 1) < 0.01
    assert shadowed > 100


def test_ground_sensors_tell_the_line_from_the_floor(make_trials: MakeTrials) -> None:
    config = DifferentialDriveConfig.model_validate(
        {
            "arena_m": (1.0, 0.8),
            "motion_noise": 0.0,
            "world": {
                "line": {"points_m": ((0.2, 0.2), (0.8, 0.2), (0.8, 0.6)), "width_m": 0.04},
                "ground": ({"at_m": (0.02, 0.0)}, {"at_m": (0.0, 0.0)}),
            },
        }
    )
    robot = config.build()
    assert isinstance(robot, WorldDrive)
    for trace in traces_of(robot, make_trials, 20, (0.3, 0.25, -0.8)):
        x, y, _ = trace.state[:-1].astype(float).T
        a, b, c = 0.2 + 0.2j, 0.8 + 0.2j, 0.8 + 0.6j
        away = np.full(len(x), np.inf)
        for p, q in ((a, b), (b, c)):
            part = np.clip(((x + 1j * y - p) / (q - p)).real, 0, 1)
            away = np.minimum(away, np.abs(x + 1j * y - p - part * (q - p)))
        centre = trace.sensors[:, 1]
        assert (centre[away < 0.012] == 0).all()
        assert (centre[away > 0.028] == 1023).all()


def test_shades_are_spread_over_the_arena(make_trials: MakeTrials) -> None:
    rows = ((0.0, 0.5), (1.0, 0.25))
    world = {"shades": rows, "ground": ({"at_m": (0.0, 0.0)},)}
    robot = DifferentialDriveConfig.model_validate({"arena_m": (1.0, 0.8), "world": world}).build()
    readings = {}
    for x, y in ((0.1, 0.1), (0.9, 0.1), (0.1, 0.7), (0.9, 0.7)):
        trials = make_trials(robot, 1, start=(x, y, 0.0), max_steps=1)
        traces = robot.trace(trials).traces
        assert traces is not None
        readings[x, y] = int(traces[0].sensors[0, 0])
    assert readings == {(0.1, 0.1): 0, (0.9, 0.1): 767, (0.1, 0.7): 1023, (0.9, 0.7): 512}


@given(st.lists(st.tuples(st.floats(0.0, 0.1), st.floats(0.0, 1.0)), min_size=1, max_size=20))
@settings(max_examples=100, deadline=None)
def test_a_fitted_response_goes_through_its_table(table: list[tuple[float, float]]) -> None:
    curve = np.array(fitted(table, 0.1))
    assert curve.min() >= 0.0
    assert curve.max() <= max(reading for _, reading in table) + 1e-12
    nodes = np.linspace(0.0, 0.1, len(curve))
    for distance in {distance for distance, _ in table}:
        readings = [reading for at, reading in table if at == distance]
        nearest = np.abs(nodes - distance).argmin()
        if nodes[nearest] == distance:
            assert curve[nearest] == pytest.approx(np.mean(readings))


def world(**keys: object) -> dict[str, object]:
    return {"world": {"infrared": ({"direction_deg": 0.0},), **keys}}


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"world": {}}, "world: expected at least one sensor"),
        (world(obstacles=({"at_m": (0.1, 0.1)},)), "radius_m: expected either radius_m"),
        (world(obstacles=({"at_m": (0.1, 0.7), "radius_m": 0.1},)), "world.obstacles: expected a point in the arena"),
        (world(walls=({"from_m": (0.1, 0.1), "to_m": (0.1, 0.1)},)), "to_m: expected another point"),
        (world(walls=({"from_m": (0.1, 0.1), "to_m": (0.1, 9.0)},)), "world.walls: expected a point in the arena"),
        (world(lamps=({"at_m": (-0.1, 0.1)},)), "world.lamps: expected a point in the arena"),
        (world(line={"points_m": ((0.1, 0.1), (0.7, 0.1))}), "world.line: expected a point in the arena"),
        (world(line={"points_m": ((0.1, 0.1), (0.1, 0.1))}), "world.line: expected different corners"),
        (world(shades=((0.0, 1.0), (0.0,))), "world.shades: expected at least 2 rows of one length"),
        (
            world(infrared=({"direction_deg": 0.0, "response": ((0.05, 0.5), (0.2, 0.5))},)),
            "response: expected distances",
        ),
        (world(infrared=({"direction_deg": 0.0, "response": ((0.05, 0.5),)},)), "readings of at least 2 distances"),
        ({**world(), "n_sensors": 5}, "n_sensors: expected nothing here beside world"),
    ],
)
def test_a_world_that_cannot_be_is_refused(section: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match="expected") as error:
        _ = DifferentialDriveConfig.model_validate(section).spec
    assert message in str(error.value)


def test_without_a_world_the_body_is_the_papers() -> None:
    robots: Callable[[], object] = DifferentialDriveConfig().build
    assert not isinstance(robots(), WorldDrive)

"""Simulated robots are drawn once each, from ranges that their kind allows."""

from __future__ import annotations

import json

import numpy as np
import pytest

from backends.cartpole import CartPoleConfig
from backends.diffdrive import DifferentialDriveConfig
from sceann_hil.config.uncertainty import ShiftedRange, UncertaintyConfig, UniformRange
from sceann_hil.errors import ConfigError
from sceann_hil.run.transfer.robots import draw_robots, robot_with

BODY = DifferentialDriveConfig(n_sensors=3)


def test_every_sensor_and_motor_has_a_value_of_its_own_and_it_is_the_robots() -> None:
    robots = draw_robots(BODY, {}, 20)
    names = list(robots.names)
    first = robots.bodies[0]
    offsets = [robots.values[0, names.index(f"gap.sensor_offset[{j}]")] for j in range(3)]
    assert first.model_dump()["gap"]["sensor_offset"] == tuple(offsets)
    assert len(set(offsets)) == 3
    assert robots.values.shape == (20, len(names))
    assert (robots.values.std(axis=0) > 0.0).all()


def test_the_same_robots_are_drawn_however_many_there_are() -> None:
    few, many = draw_robots(BODY, {}, 20), draw_robots(BODY, {}, 40)
    assert few.bodies == many.bodies[:20]


def test_a_number_fixes_a_key_and_a_factor_scales_the_bodys_own() -> None:
    given = UncertaintyConfig.model_validate({"keys": {"motion_noise": 0.1, "radius_m": {"scaled": [2.0, 2.5]}}})
    robots = draw_robots(BODY, given.keys, 20)
    assert "motion_noise" not in robots.names
    radii = robots.values[:, robots.names.index("radius_m")] / BODY.radius_m
    assert (radii >= 2.0).all()
    assert (radii <= 2.5).all()


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ({"gap.latency_steps": UniformRange(uniform=(0.0, 20.0))}, "gap.latency_steps: 20 is more than robot"),
        ({"wheels": 3.0}, "wheels: 3 is more than robot"),
        ({"motion_noise": UniformRange(uniform=(-0.5, 0.1))}, "motion_noise: -0.5 is more than robot"),
    ],
)
def test_what_the_body_does_not_allow_is_refused_by_name(keys: dict[str, float], told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        draw_robots(BODY, keys, 20)


def test_a_robot_can_be_written_down_from_its_values() -> None:
    robots = draw_robots(BODY, {}, 20)
    data = robot_with(BODY, robots.names, robots.values[3])
    assert data["gap"]["motor_gain"] == list(robots.bodies[3].model_dump()["gap"]["motor_gain"])
    assert np.isclose(data["radius_m"], robots.bodies[3].model_dump()["radius_m"])


def test_in_a_world_every_sensor_has_a_range_and_a_tilt_of_its_own_and_the_world_stays() -> None:
    body = DifferentialDriveConfig.model_validate_json(json.dumps(IN_A_WORLD))
    robots = draw_robots(body, {}, 20)
    names = list(robots.names)
    assert "world.infrared.range_m[1]" in names
    assert "world.light.direction_deg" in names
    assert not any(name.startswith("sensor_") for name in names)
    first = robots.bodies[0].model_dump(mode="json")
    tilts = [robots.values[0, names.index(f"world.infrared.direction_deg[{i}]")] for i in range(2)]
    assert [one["direction_deg"] for one in first["world"]["infrared"]] == tilts
    assert np.abs(np.array(tilts) - [-30.0, 30.0]).max() <= 5.0
    assert first["world"]["obstacles"] == body.model_dump(mode="json")["world"]["obstacles"]
    assert len(first["gap"]["sensor_offset"]) == 3
    again = robot_with(robots.bodies[1], robots.names, robots.values[0])
    assert DifferentialDriveConfig.model_validate_json(json.dumps(again)) == robots.bodies[0]


def test_a_key_of_things_that_the_body_does_not_have_is_refused() -> None:
    body = DifferentialDriveConfig.model_validate_json(json.dumps(IN_A_WORLD))
    with pytest.raises(ConfigError, match=r"world\.ground\.direction_deg: robot diffdrive has none"):
        draw_robots(body, {"world.ground.direction_deg": ShiftedRange(shifted=(-1.0, 1.0))}, 20)


def test_robots_that_are_all_the_same_are_refused() -> None:
    body = CartPoleConfig()
    certain = dict.fromkeys(body.usual_uncertainty, 0.0)
    with pytest.raises(ConfigError, match="all simulated robots are the same"):
        draw_robots(body, certain, 20)


IN_A_WORLD = {
    "type": "diffdrive",
    "world": {
        "obstacles": [{"at_m": [0.3, 0.3], "radius_m": 0.05}],
        "lamps": [{"at_m": [0.5, 0.5]}],
        "infrared": [{"direction_deg": -30.0}, {"direction_deg": 30.0, "range_m": 0.2}],
        "light": [{"direction_deg": 0.0}],
    },
}

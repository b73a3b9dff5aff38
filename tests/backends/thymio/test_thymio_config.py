"""What a Thymio's section refuses, its twin, and the arena that the makers' simulator is given."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from backends.thymio import ThymioConfig, ThymioTwinConfig
from backends.thymio.scene import FLOOR, scene
from sceann_hil.firmware.aesl.program import Senses
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import Trials
from sceann_hil.testing import RobotConformance

TWIN: dict[str, Any] = {"type": "thymio_twin", "sensors": ["infrared", "ground"]}


def thymio(**changes: Any) -> ThymioConfig:
    return ThymioConfig.model_validate_json(json.dumps({"type": "thymio", "playground": True, "twin": TWIN, **changes}))


def twin(**changes: Any) -> ThymioTwinConfig:
    return ThymioTwinConfig.model_validate_json(json.dumps({**TWIN, **changes}))


class TestTwin(RobotConformance):
    def config(self) -> ThymioTwinConfig:
        return twin()

    def start(self) -> tuple[float, ...]:
        return (0.5, 0.5, 0.0)


def test_a_robot_is_what_its_section_says() -> None:
    config = thymio(sensors=["infrared", "ground"])
    assert (config.spec.n_sensors, config.spec.n_motors, config.spec.attended) == (9, 2, False)
    assert config.aesl_life.senses == Senses(True, True)
    assert config.simulated == config.twin
    assert thymio(playground=False, port="/dev/ttyACM0", twin=None).spec.attended


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"host": "localhost"}, "port: expected one of port, host and playground"),
        ({"playground": False}, "port: expected one of port, host and playground"),
        ({"twin": None}, "twin: expected the simulated arena"),
        ({"sensors": ["infrared"]}, "twin.sensors: expected the robot's"),
        ({"sensors": ["ground", "infrared"]}, r"sensors: expected \[infrared\]"),
        ({"tick_s": 0.0505}, "tick_s: expected whole milliseconds"),
        ({"ground_black": 900, "ground_white": 800}, "ground_black: expected less"),
        ({"sensors": ["infrared", "ground"], "ends": [{"reason": "goal", "sensor": 9, "above": 0.5}]}, "sensor 0..8"),
        ({"host": "a b", "playground": False}, "host"),
    ],
)
def test_what_does_not_fit_together_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        thymio(**changes)


def test_a_twin_has_a_thymio_s_sensors_and_no_others() -> None:
    with pytest.raises(ValidationError, match=r"world.lamps: expected nothing here"):
        twin(world={"lamps": [{"at_m": [0.5, 0.5]}]})
    with pytest.raises(ValidationError, match="arena_m: expected at least"):
        twin(arena_m=[0.2, 1.0])
    assert "where world.obstacles[0] stands" in twin(
        world={"obstacles": [{"at_m": [0.5, 0.5], "radius_m": 0.1}]}
    ).refuses_start({"x_m": 0.5, "y_m": 0.6, "heading_rad": 0.0})


def sees(config: ThymioTwinConfig, *start: float) -> list[int]:
    size = NetworkSize(9, 0, 2)
    trials = Trials(
        size=size,
        dynamics=Dynamics(),
        weights=np.zeros((1, 2, 11), np.int8),
        genome_index=np.zeros(1, np.int32),
        starts=np.array([start]),
        keys=np.zeros(1, np.uint64),
        max_steps=1,
        ids=np.zeros(1, np.int64),
    )
    traces = config.build().trace(trials).traces
    assert traces is not None
    return [int(value) for value in traces[0].sensors[0]]


def test_the_twin_sees_what_the_makers_simulator_sees() -> None:
    # readings of Aseba Playground, divided by 4, at the same places
    line = twin(world={"line": {"points_m": [[0.0, 0.55], [1.1, 0.55]], "width_m": 0.06}})
    assert sees(line, 0.55, 0.8, 0.0) == [0] * 7 + [1023, 1023]
    assert sees(line, 0.55, 0.55, 0.0) == [0] * 7 + [0, 0]
    before_a_wall = sees(line, 1.0, 0.8, 0.0)
    assert before_a_wall[2] == pytest.approx(1069 - 62, abs=45)
    assert before_a_wall[1] == pytest.approx(before_a_wall[3], abs=2)
    assert before_a_wall[5:7] == [0, 0]
    left = sees(line, 0.55, 1.0, 0.0)
    assert left[0] > left[1] > left[2] == 0


def test_the_arena_of_a_twin_is_a_scene_of_the_simulator() -> None:
    world = {
        "obstacles": [
            {"at_m": [0.5, 0.4], "radius_m": 0.1},
            {"at_m": [0.8, 0.4], "size_m": [0.2, 0.1], "angle_deg": 90},
        ],
        "walls": [{"from_m": [0.1, 0.1], "to_m": [0.1, 0.5]}],
        "line": {"points_m": [[0.1, 0.9], [1.0, 0.9]], "width_m": 0.05},
    }
    text, files = scene(twin(world=world), {"x_m": 0.3, "y_m": 0.7, "heading_rad": 1.5})
    assert '<cylinder x="50" y="40" r="10" h="10" color="wall" />' in text
    assert '<wall x="80" y="40" l1="20" l2="10" h="10" angle="1.570796" color="wall" />' in text
    assert '<wall x="10" y="30" l1="40" l2="1" h="10" angle="1.570796" color="wall" />' in text
    assert '<robot type="thymio2" x="30.0000" y="70.0000" angle="1.500000" port="33333"' in text
    assert f'groundTexture="{FLOOR}"' in text
    head, pixels = files[FLOOR].split(b"255\n", 1)
    columns, rows = map(int, head.split(b"\n")[1].split())
    picture = np.frombuffer(pixels, np.uint8).reshape(rows, columns)
    # the first row is the upper one
    assert picture[round(0.2 / 1.1 * rows), columns // 2] == 0
    assert picture[round(0.9 / 1.1 * rows), columns // 2] == 255


def test_a_robot_without_a_start_stands_in_a_free_place() -> None:
    middle = {"at_m": [0.55, 0.55], "radius_m": 0.3}
    for world in ({}, {"obstacles": [middle]}, {"obstacles": [{"at_m": [0.15, 0.15], "radius_m": 0.05}]}):
        config = twin(world=world)
        text, _ = scene(config, {})
        found = re.search(r'<robot type="thymio2" x="([0-9.]+)" y="([0-9.]+)"', text)
        assert found is not None
        start = {"x_m": float(found[1]) / 100.0, "y_m": float(found[2]) / 100.0, "heading_rad": 0.0}
        assert config.refuses_start(start) == ""

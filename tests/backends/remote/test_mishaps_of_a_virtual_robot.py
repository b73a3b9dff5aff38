"""What a user of a virtual robot stumbles over: it lies where its last trial ended, or cannot be what was asked."""

from __future__ import annotations

import json
import socket
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from backends.cartpole import CartPole, CartPoleConfig
from backends.virtual.body import VirtualBody
from backends.virtual.power import VirtualRobot
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.cli import app
from sceann_hil.errors import CannotWrite, ConfigError, as_user_error
from sceann_hil.robot.diagnosis import Verdict
from tests.backends.remote.trials import virtual_config


def test_the_doctor_knows_a_pressed_bumper_from_a_bad_cable() -> None:
    body = VirtualBody(CartPole())
    body.place([0.0, 0.0, 0.5, 0.0])
    while not body.pressed:
        body.hold()
    with VirtualPosix(body) as virtual, virtual_config(virtual, "onboard").build() as robot:
        *_, last = robot.diagnose()
    assert (last.check, last.verdict) == ("alarms", Verdict.BAD)
    assert "cable" not in last.advice


def test_a_rig_port_in_use_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(ConfigError, match="--rig-port"):
        VirtualPosix(VirtualBody(CartPole()), rig_port=taken.getsockname()[1])


@pytest.mark.parametrize("option", ["--write", "--port", "--store"])
def test_a_folder_that_is_not_there_is_told_before_the_robot_is_on(option: str, tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text(
        "{task: {type: pole_balancing}, robot: {type: cartpole, n_sensors: 2}, "
        "controller: {coding: sceann3, n_hidden: 1}, algorithm: {type: sga}}"
    )
    place = tmp_path / "no_folder" / "file"
    result = CliRunner().invoke(app, ["virtual", "posix", str(tmp_path / "c.yaml"), option, str(place)])
    assert result.exception is not None
    told = as_user_error(result.exception)
    assert isinstance(told, CannotWrite)
    assert str(place) in told.message
    assert "is on" not in result.output


def test_a_board_without_a_body_of_its_own_serves_the_loop() -> None:
    robot = VirtualRobot({"port": "p"}, CartPoleConfig(), None)
    assert robot.section()["mode"] == "hil"
    assert robot.section()["body"]["type"] == "cartpole"
    with pytest.raises(ConfigError, match="expected hil, got 'onboard'"):
        robot.section("onboard")


def test_in_the_loop_its_gap_is_one_robots_too_and_that_of_its_seed() -> None:
    drawn = CartPoleConfig.model_validate({"gap": {"sensor_offset": {"normal": (0.0, 0.01)}, "motor_gain": 0.9}})
    section = VirtualRobot({"port": "p"}, drawn, None, seed=7).section("hil")["body"]
    in_the_loop = CartPoleConfig.model_validate_json(json.dumps(section)).gap.build(2, 1)
    on_its_pins = CartPole(drawn).gap.of_robot(7)
    trials = np.arange(3, dtype=np.uint64)
    gap = in_the_loop.draw(trials, 2, 1, 0.5)
    assert (gap == gap[0]).all()
    assert (gap == on_its_pins.draw(trials, 2, 1, 0.5)).all()
    certain = CartPoleConfig.model_validate({"gap": {"motor_gain": 0.9}})
    assert VirtualRobot({"port": "p"}, certain, None).section("hil")["body"] == certain.model_dump(mode="json")

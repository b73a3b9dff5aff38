"""docs/first-robot.md line by line, on an emulated Uno; its configurations are the robot of the drawing."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from backends.remote import RemoteConfig
from backends.virtual.power import switch_on
from sceann_hil.config import load_config
from sceann_hil.firmware.build import Board
from sceann_hil.run.plan import Plan
from tests.pages import ROOT, commands_of, follow, only_late

CONFIGS = ROOT / "configs"


def _in_simulation() -> Any:
    return load_config(CONFIGS / "uno.yaml")


def _on_the_robot() -> Any:
    return load_config(CONFIGS / "uno_robot.yaml")


def test_the_robot_and_its_twin_are_the_same() -> None:
    simulated, robot = _in_simulation(), _on_the_robot()
    assert isinstance(robot.robot, RemoteConfig)
    assert robot.robot.twin is not None
    ideal = simulated.robot.model_copy(update={"gap": type(simulated.robot.gap)()})
    assert robot.robot.twin == ideal
    assert robot.task == simulated.task
    assert robot.controller == simulated.controller
    assert robot.robot.tick_s == simulated.robot.tick_s


def test_the_configuration_is_the_robot_of_the_drawing() -> None:
    drawing = (ROOT / "firmware" / "wiring.svg").read_text(encoding="utf-8")
    drawn = []
    for words in re.findall(r"IR distance sensor \d</text>\s*<text[^>]*>([^<]+)<", drawing):
        angle = re.match(r"(\d+)° to the (right|left)", words)
        drawn.append(0.0 if angle is None else float(angle[1]) * (-1 if angle[2] == "right" else 1))
    sensors = _in_simulation().robot.world.infrared
    assert [sensor.direction_deg for sensor in sensors] == drawn
    # 4 cm behind the rim, looking outwards: nothing comes nearer than a Sharp sensor can tell
    for sensor in sensors:
        assert np.hypot(*sensor.at_m) == pytest.approx(0.045, abs=1e-3)
        assert np.degrees(np.arctan2(*reversed(sensor.at_m))) == pytest.approx(sensor.direction_deg, abs=0.5)


def test_the_planned_numbers_fit_an_afternoon() -> None:
    plan = Plan.of(_on_the_robot())
    assert plan.fits.startswith("yes")
    assert plan.longest_wall_s < 3 * 3600


@pytest.mark.realtime
def test_the_page_line_by_line(tmp_path: Path) -> None:
    shutil.copytree(CONFIGS, tmp_path / "configs")
    port = tmp_path / "ttyACM0"
    body = _in_simulation()
    with switch_on(Board.UNO, body.robot, port=port, start=body.build_task().starts[0].tolist()) as uno:
        section = tmp_path / "configs" / "uno_robot.yaml"
        # the port as the page says, and a machine in the place of the person who puts the robot back
        text = section.read_text(encoding="utf-8").replace("/dev/ttyACM0", str(port))
        section.write_text(
            text.replace("  mode: onboard", f"  rig: {uno.rig_address}\n  mode: onboard"), encoding="utf-8"
        )

        def shorter(words: list[str]) -> list[str]:
            words = [str(port) if word == "/dev/ttyACM0" else word for word in words]
            if words[:2] == ["sceann", "view"]:
                return [*words, "--picture", f"{Path(words[2]).name}.png"]
            if words[:2] == ["sceann", "transfer"]:
                words = [*words, "--trials", "2", "--rounds", "1", "--record", "best", "--set", "uncertainty.robots=20"]
                return [*words, "--set", "task.max_steps=15"]
            if words[1] == "evolve" and "uno_robot" in words[2]:
                words = [
                    *words,
                    "--record",
                    "none",
                    "--set",
                    "algorithm.population=2",
                    "--set",
                    "algorithm.generations=0",
                ]
                return [*words, "--set", "task.max_steps=15"]
            return words

        printed = follow("first-robot.md", tmp_path, shorter, only_late)
    told = printed
    assert "each of 2 was driven" in told
    assert "Recommended: controller" in told
    assert "runs by itself" in told or "button" in told
    assert (tmp_path / "walker.h").read_text(encoding="utf-8").count("walker_") > 5
    assert all((tmp_path / f"{name}.png").stat().st_size > 10_000 for name in ("uno", "uno-robot"))


def test_the_page_has_the_commands_from_the_box_to_the_champion() -> None:
    verbs = [command.split()[1] for command in commands_of("first-robot.md")]
    for one in ("plan", "evolve", "view", "flash", "doctor", "transfer", "champion", "export"):
        assert one in verbs
    assert any("--autorun 50 --on-button" in command for command in commands_of("first-robot.md"))

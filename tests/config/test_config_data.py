"""Python values instead of a file: the same configurations, the same refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sceann_hil.config import ExperimentConfig, config_from, dump_config, parse_config, with_robot_of
from sceann_hil.errors import ConfigError
from sceann_hil.network.coding import Coding

DATA: dict[str, Any] = {
    "task": {"type": "reach", "start_m": (0.1, 0.2)},
    "robot": {"type": "rover", "n_sensors": np.int64(3)},
    "controller": {"coding": Coding.SCEANN3, "n_hidden": 2},
    "algorithm": {"type": "climb"},
}
TEXT = """
task: {type: reach, start_m: [0.1, 0.2]}
robot: {type: rover, n_sensors: 3}
controller: {coding: sceann3, n_hidden: 2}
algorithm: {type: climb}
"""

pytestmark = pytest.mark.usefixtures("bench")


@pytest.fixture
def config() -> ExperimentConfig:
    return config_from(DATA, "test")


def test_a_mapping_is_the_same_configuration_as_a_file(config: ExperimentConfig) -> None:
    assert dump_config(config) == dump_config(parse_config(TEXT, "test"))


def test_arrays_and_tuples_are_lists() -> None:
    config = config_from({**DATA, "task": {"type": "reach", "headings_deg": np.array([1.0, 2.0])}}, "test")
    assert config.task.model_dump()["headings_deg"] == (1.0, 2.0)


def test_a_change_replaces_the_value_at_its_key_and_nothing_else(config: ExperimentConfig) -> None:
    changed = config.with_changes({"robot.gap.motor_gain": {"uniform": (0.9, 1.1)}, "algorithm.population": 7}, seed=3)
    text = dump_config(config).replace("motor_gain: 1.0", "motor_gain:\n      uniform: [0.9, 1.1]")
    assert dump_config(changed) == text.replace("population: 25", "population: 7").replace("seed: 1", "seed: 3")


def test_a_section_is_replaced_as_a_whole(config: ExperimentConfig) -> None:
    changed = config.with_changes({"robot.n_sensors": 5}).with_changes(robot={"type": "rover"})
    assert changed.size.n_sensors == 3


def test_a_section_of_another_configuration_can_be_given(config: ExperimentConfig) -> None:
    other = config.with_changes({"robot.n_sensors": 5})
    assert config.with_changes(robot=other.robot) == other


def test_no_change_gives_an_equal_configuration(config: ExperimentConfig) -> None:
    assert config.with_changes() == config


def test_settings_are_as_on_the_command_line(config: ExperimentConfig) -> None:
    assert config.with_changes(settings=["robot.n_sensors=4", "robot.n_sensors=5"]).size.n_sensors == 5


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"robot.n_sensers": 3}, "change of robot.n_sensers: robot.n_sensers: unknown key, did you mean"),
        ({"robot.n_sensors": "3"}, "change of robot.n_sensors: robot.n_sensors: expected a whole number, got the text"),
        ({"algorithm.elites": 30}, "change of algorithm.elites: algorithm.elites: expected fewer than population (25)"),
        ({"seed": -1}, "change of seed: seed: expected at least 0, got -1"),
        ({"seed": float("nan")}, "change of seed: seed: expected a"),
        ({"robot": {"n_sensors": 3}}, "robot.type: this key is missing, expected rover or stilt"),
        ({"robot..x": 1}, "change of robot..x: expected a key such as seed or algorithm.population"),
        ({"seed.x": 1}, "change of seed.x: seed is 1, not a section with keys; set it as a whole"),
        ({"task.start_m": {1, 2}}, "task.start_m: expected what YAML can hold, got an object of type set"),
        ({"task": {1: 2}}, "change of task: task: expected text as key, got 1"),
    ],
)
def test_what_is_wrong_with_a_change_names_the_change(
    config: ExperimentConfig, changes: dict[str, Any], message: str
) -> None:
    with pytest.raises(ConfigError) as caught:
        config.with_changes(changes)
    assert message in caught.value.message


def test_a_value_without_end_is_refused(config: ExperimentConfig) -> None:
    endless: dict[str, Any] = {}
    endless["deeper"] = endless
    with pytest.raises(ConfigError, match="nested more than 20 levels deep"):
        config.with_changes(robot=endless)


def test_the_robot_of_another_file(config: ExperimentConfig, tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text("robot: {type: rover, n_sensors: 5}\n")
    assert with_robot_of(config, path) == config.with_changes({"robot.n_sensors": 5})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("robot:\n  type: rover\n  n_sensors: 0\n", ":3:14: robot.n_sensors: expected at least 1, got 0"),
        (
            "robot:\n  type: rover\n  n_sensors: !!int 3\n",
            ":3:14: robot.n_sensors: the tag !!int is not supported, remove it",
        ),
        ("task: {type: reach}\n", ": expected a section robot, got nothing"),
        ("- 1\n", ": expected a section robot, got nothing"),
    ],
)
def test_what_is_wrong_with_another_robot_is_said_where_it_stands(
    config: ExperimentConfig, tmp_path: Path, text: str, message: str
) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        with_robot_of(config, path)
    assert caught.value.message.startswith(f"{path}{message}")

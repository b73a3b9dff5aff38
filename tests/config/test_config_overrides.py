"""--set key.sub=value: the same checks, and messages of the same quality, as for the file."""

from __future__ import annotations

from pathlib import Path

import pytest

from sceann_hil.config import ExperimentConfig, load_config
from sceann_hil.errors import ConfigError

TEXT = """\
seed: 7
task: {type: reach}
robot: {type: rover}
controller:
  coding: sceann3
  n_hidden: 2
algorithm:
"""

pytestmark = pytest.mark.usefixtures("bench")


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = Path("run.yaml")
    path.write_text(TEXT)
    return path


def load(file: Path, *overrides: str) -> ExperimentConfig:
    return load_config(file, ["algorithm.type=climb", *overrides])


def test_a_value_replaces_the_one_of_the_file(file: Path) -> None:
    assert load(file, "controller.n_hidden=4").controller.n_hidden == 4


def test_the_last_of_two_settings_wins(file: Path) -> None:
    assert load(file, "seed=3", "seed=4").seed == 4


def test_values_are_yaml_so_lists_and_whole_sections_can_be_set(file: Path) -> None:
    config = load(file, "task.start_m=[0.1, 1e-3]", "robot={type: rover, n_sensors: 5}")
    assert config.task.model_dump()["start_m"] == (0.1, 0.001)
    assert config.size.n_sensors == 5


def test_sections_on_the_way_are_made(file: Path) -> None:
    config = load(file, "robot.gap.motor_gain={uniform: [0.9, 1.1]}")
    assert config.robot.model_dump()["gap"]["motor_gain"] == {"uniform": (0.9, 1.1)}


def test_a_setting_corrects_what_is_wrong_in_the_file(file: Path) -> None:
    file.write_text(TEXT.replace("n_hidden: 2", "n_hidden: two"))
    assert load(file, "controller.n_hidden=2").controller.n_hidden == 2


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            "algorithm.tournment=3",
            "--set algorithm.tournment=3: unknown key, did you mean algorithm.tournament? Expected elites, "
            "generations, mutation_rate, population, step_bits, tournament or type",
        ),
        ("seed=-1", "--set seed=-1: expected at least 0, got -1"),
        ("seed=", "--set seed=: expected a whole number, got nothing"),
        (
            "sede=1",
            "--set sede=1: unknown key, did you mean seed? Expected algorithm, budget, controller, name, operator, "
            "reference, robot, saving, seed, suspenders, task or uncertainty",
        ),
        ("task.start_m=[1]", "--set task.start_m=[1]: expected 2 values, got a list of 1 value"),
        (
            "task={type: reach, max_steps: 0}",
            "--set task={type: reach, max_steps: 0}: task.max_steps: expected at least 1, got 0",
        ),
        (
            "robot.type=rovr",
            "--set robot.type=rovr: expected rover or stilt, got the text 'rovr', did you mean rover?",
        ),
        ("seed.x=1", "--set seed.x=1: seed is 7, not a section with keys; set it as a whole"),
        ("seed", "--set seed: expected key=value or section.key=value"),
        ("=1", "--set =1: expected key=value or section.key=value"),
        ("task..x=1", "--set task..x=1: expected key=value or section.key=value"),
        (
            "task.start_m=[1",
            "--set task.start_m=[1: not valid YAML: expected ',' or ']', but got '<stream end>'",
        ),
        (
            "robot.n_sensors=21",
            "--set robot.n_sensors=21: "
            "robot.n_sensors (--set robot.n_sensors=21) and controller.n_hidden (line 6): "
            "n_sensors + n_hidden + n_motors: expected at most 23 sources (a larger sum could overflow the "
            "16-bit neuron), got 21 + 2 + 2 = 25",
        ),
    ],
)
def test_a_wrong_setting_is_named_as_it_was_typed(file: Path, override: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load(file, override)
    assert caught.value.message == message


def test_problems_of_the_file_come_first(file: Path) -> None:
    file.write_text(TEXT.replace("n_hidden: 2", "n_hidden: two"))
    with pytest.raises(ConfigError) as caught:
        load(file, "sed=1", "task.max_steps=0")
    assert [line.split(":")[0].strip() for line in caught.value.message.splitlines()] == [
        "3 problems in the configuration",
        "run.yaml",
        "--set sed=1",
        "--set task.max_steps=0",
    ]

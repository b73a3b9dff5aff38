"""The configurations that we ship: valid, current, and what their comments promise."""

from __future__ import annotations

import json
import re
from pathlib import Path

import jsonschema
import pytest
import yaml

from sceann_hil.config import load_config, parse_config, schema_text
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.run.experiment import Experiment

CONFIGS = Path(__file__).parent.parent.parent / "configs"
FILES = sorted(CONFIGS.glob("*.yaml"))


def test_the_shipped_schema_is_current() -> None:
    assert (CONFIGS / "schema.json").read_text(encoding="utf-8") == schema_text(), (
        "write it again: sceann schema > configs/schema.json"
    )


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_shipped_configuration_is_valid_and_named_after_its_file(path: Path) -> None:
    assert load_config(path).name == path.stem.replace("_", " ")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_editor_finds_the_schema_and_has_nothing_to_underline(path: Path) -> None:
    first_line, _, text = path.read_text(encoding="utf-8").partition("\n")
    line = re.fullmatch(r"# yaml-language-server: \$schema=(\S+)", first_line)
    assert line
    schema = json.loads((path.parent / line[1]).read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(yaml.safe_load(text))


@pytest.mark.parametrize(
    ("file", "robot", "task"),
    [
        ("goal_reach.yaml", "diffdrive", "goal_reach"),
        ("pole_balancing.yaml", "cartpole", "pole_balancing"),
    ],
)
def test_the_values_written_out_are_the_defaults(file: str, robot: str, task: str) -> None:
    minimal = parse_config(
        f"task: {{type: {task}}}\nrobot: {{type: {robot}}}\n"
        "controller: {coding: sceann3, n_hidden: 2}\nalgorithm: {type: oga}\n",
        "minimal",
    )
    shipped = load_config(CONFIGS / file)
    assert shipped.robot == minimal.robot
    assert shipped.task == minimal.task
    assert shipped.algorithm == minimal.algorithm
    assert shipped.controller.dynamics == minimal.controller.dynamics


@pytest.mark.parametrize(
    ("file", "size"),
    [
        ("quickstart.yaml", NetworkSize(2, 3, 1)),
        ("pole_balancing.yaml", NetworkSize(2, 3, 1)),
        ("goal_reach.yaml", NetworkSize(7, 2, 2)),
    ],
)
def test_the_conditions_are_those_of_the_paper(file: str, size: NetworkSize) -> None:
    config = load_config(CONFIGS / file)
    assert config.size == size
    assert config.controller.coding is Coding.SCEANN3
    assert (config.algorithm.population, config.algorithm.generations) == (25, 50)


def test_the_quick_start_solves_its_task(tmp_path: Path) -> None:
    config = load_config(CONFIGS / "quickstart.yaml")
    best: list[float] = []
    with Experiment.create(config, tmp_path / "run") as experiment, config.robot.build() as robot:
        experiment.evolve(robot, lambda progress: best.append(progress.champion.fitness))
    assert max(best) == config.task.build().best_fitness

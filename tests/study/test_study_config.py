"""A study is checked as a whole before anything runs, and every complaint names the axis."""

from __future__ import annotations

import json
from pathlib import Path

import jsonschema
import pytest
import yaml
from small_study import SMALL

from sceann_hil.errors import ConfigError
from sceann_hil.study import load_conditions, load_study, parse_study, study_schema_text

PAPER = Path(__file__).parents[2] / "configs" / "paper"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("[2, 4]", "[2, 3]", "small.yaml:11:24: robot.n_sensors: expected 2 or 4, got 3, on the axis robot.n_sensors"),
        ("[sga, oga]", "[sga, ogo]", "did you mean oga?, on the axis algorithm.type"),
        ("robot.n_sensors:", "robot.n_sensor:", "did you mean robot.n_sensors?"),
        ("robot.n_sensors: [2, 4]", "controller.n_hidden: [2, 90]", "on the axis controller.n_hidden"),
        ("[2, 4]", "[2, 4, 2]", "grid.robot.n_sensors: 2 is on this axis already"),
        ("[2, 4]", "[]", "at least 1 value"),
        ("[2, 4]", "4", "expected a list, got 4"),
        ("grid:", "grid:\n  algorithm: [{type: sga}]", "the axis algorithm replaces this key as well"),
        ("grid:", "grid:\n  seed: [1, 2]", "seed cannot be an axis"),
        ("base:", "base:\n  seed: 7", "base.seed: a study has its own seed"),
        ("grid:", "gird:", "gird: unknown key, did you mean grid?"),
        ("runs: 12", "runs: 0", "runs: expected at least 1, got 0"),
        ("max_steps: 400", "max_step: 400", "did you mean task.max_steps?"),
    ],
)
def test_a_contradiction_is_refused_with_its_place(old: str, new: str, expected: str) -> None:
    with pytest.raises(ConfigError) as refused:
        parse_study(SMALL.replace(old, new, 1), "small.yaml")
    assert expected in refused.value.message
    assert "Nothing was started" in refused.value.hint


def test_two_conditions_that_are_one_experiment_are_refused() -> None:
    text = SMALL.replace("  algorithm.type: [sga, oga]", "  algorithm: [{type: sga}, {type: sga, tournament: 2}]")
    with pytest.raises(ConfigError, match="are the same experiment"):
        parse_study(text, "small.yaml")


def test_the_same_mistake_is_told_once_whatever_the_number_of_conditions() -> None:
    with pytest.raises(ConfigError) as refused:
        parse_study(SMALL.replace("[2, 4]", "[2, 3]"), "small.yaml")
    assert refused.value.message.count("expected 2 or 4") == 1


def test_the_last_axis_varies_fastest() -> None:
    labels = [condition.label for condition in parse_study(SMALL, "small.yaml").conditions]
    assert labels == ["sga, n_sensors=2", "sga, n_sensors=4", "oga, n_sensors=2", "oga, n_sensors=4"]


def test_an_algorithm_brings_its_own_defaults() -> None:
    sga, *_, oga = parse_study(SMALL, "small.yaml").conditions
    assert sga.config.model_dump()["algorithm"]["tournament"] == 2
    assert oga.config.model_dump()["algorithm"]["tournament"] == 6


def test_a_default_that_is_written_out_changes_no_seed() -> None:
    written = SMALL.replace("{type: cartpole}", "{type: cartpole, tick_s: 0.02}")
    for one, other in zip(parse_study(SMALL, "a").conditions, parse_study(written, "b").conditions, strict=True):
        assert one.identity == other.identity


@pytest.mark.parametrize("path", sorted(PAPER.glob("*.yaml")), ids=lambda path: path.stem)
def test_a_shipped_study_is_valid_named_after_its_file_and_has_the_paper_s_runs(path: Path) -> None:
    first_line, _, text = path.read_text(encoding="utf-8").partition("\n")
    assert first_line == "# yaml-language-server: $schema=schema.json"
    jsonschema.Draft202012Validator(json.loads(study_schema_text())).validate(yaml.safe_load(text))
    study = load_study(path)
    assert study.config.name == path.stem
    assert study.config.runs == 50
    expected = {"tables": 20, "fig10": 60, "fig6": 150}
    assert len(study.conditions) == expected.get(path.stem, len(study.conditions))
    assert all(c.config.algorithm.model_dump()["population"] == 25 for c in study.conditions)
    assert all(c.config.algorithm.generations == 50 for c in study.conditions)


def test_the_shipped_schema_of_studies_is_current() -> None:
    assert (PAPER / "schema.json").read_text(encoding="utf-8") == study_schema_text(), (
        "write it again: sceann schema --study > configs/paper/schema.json"
    )


def test_the_studies_of_the_paper_differ_in_their_seeds() -> None:
    seeds = [load_study(PAPER / f"{name}.yaml").config.seed for name in ("tables", "fig10", "fig6")]
    assert len(set(seeds)) == 3


def test_an_experiment_is_a_study_of_one_condition() -> None:
    name, conditions = load_conditions(PAPER.parent / "pole_balancing.yaml")
    assert name == "pole balancing"
    assert [condition.config.genome_length for condition in conditions] == [24]

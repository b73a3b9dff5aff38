"""The JSON schema for editors agrees with the validation."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from sceann_hil.config import dump_config, json_schema, parse_config, schema_text
from sceann_hil.errors import ConfigError

pytestmark = pytest.mark.usefixtures("bench")

GOOD = """\
task: {type: reach}
robot: {type: rover}
controller: {coding: sceann3, n_hidden: 2}
algorithm: {type: climb}
"""


def validator() -> jsonschema.Draft202012Validator:
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_the_schema_accepts_a_minimal_and_a_canonical_configuration() -> None:
    validator().validate(yaml.safe_load(GOOD))
    validator().validate(yaml.safe_load(dump_config(parse_config(GOOD, "good"))))


@pytest.mark.parametrize(
    "wrong",
    [
        {"seed": -1},
        {"name": "../escape"},
        {"sede": 1},
        {"task": {"type": "reech"}},
        {"task": {"max_steps": 3}},
        {"task": {"type": "stand"}},
        {"task": {"type": "reach", "max_step": 3}},
        {"task": {"type": "reach", "start_m": [1]}},
        {"robot": {"type": "rover", "gap": {"sensor_offset": "high"}}},
        {"controller": {"coding": "sceann4", "n_hidden": 2}},
        {"controller": {"coding": "sceann3"}},
        {"algorithm": None},
    ],
)
def test_schema_and_validation_refuse_the_same(wrong: dict[str, Any]) -> None:
    data = {**yaml.safe_load(GOOD), **wrong}
    assert not validator().is_valid(data)
    with pytest.raises(ConfigError):
        parse_config(yaml.safe_dump(data), "wrong")


def test_keys_carry_their_documentation() -> None:
    definitions = json_schema()["$defs"]
    assert definitions["RoverConfig"]["properties"]["tick_s"]["description"] == "Control step."
    assert all("description" in field for field in definitions["ControllerConfig"]["properties"].values())


def test_no_definition_is_left_over() -> None:
    text = schema_text()
    for name in json.loads(text)["$defs"]:
        assert f'"#/$defs/{name}"' in text


def test_plugins_whose_models_have_equal_names_do_not_mix(install: Any, tmp_path: Path) -> None:
    source = (Path(__file__).parent / "bench_plugins.py").read_text().replace('"rover"', '"twin"')
    (tmp_path / "site" / "twin_plugins.py").write_text(source.replace("latency_steps", "delay_steps"))
    install("twin", {"robots": {"twin": "twin_plugins:RoverConfig"}})
    schema = validator()
    data = yaml.safe_load(GOOD)
    assert schema.is_valid({**data, "robot": {"type": "twin", "gap": {"delay_steps": 1}}})
    assert schema.is_valid({**data, "robot": {"type": "rover", "gap": {"latency_steps": 1}}})
    assert not schema.is_valid({**data, "robot": {"type": "rover", "gap": {"delay_steps": 1}}})

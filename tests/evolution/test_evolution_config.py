"""The settings models: strict, described, and true to the paper."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from sceann_hil.evolution import GenerationalConfig, OGAConfig, SGAConfig
from sceann_hil.evolution.oga_options import InitialOperons, Scope


def test_the_ogas_defaults_are_the_papers() -> None:
    config = OGAConfig()
    assert (config.population, config.generations, config.tournament, config.elites) == (25, 50, 6, 1)
    assert (config.connection, config.division) == (0.3, 0.3)
    assert (config.duplication, config.deletion, config.inversion) == (0.6, 0.3, 0.3)
    assert config.cap == 6


def test_every_enum_option_defaults_to_its_first_value() -> None:
    for name, field in OGAConfig.model_fields.items():
        if hasattr(field.default, "code"):
            assert field.default.code == 0, name


def test_settings_survive_the_way_through_text(config: GenerationalConfig) -> None:
    assert type(config).model_validate(config.model_dump(mode="json")) == config
    assert type(config).model_validate_json(config.model_dump_json()) == config


def test_options_are_written_as_words() -> None:
    config = OGAConfig.model_validate({"type": "oga", "scope": "per_individual"})
    assert config.scope is Scope.PER_INDIVIDUAL
    assert config.build(24).options.scope is Scope.PER_INDIVIDUAL


@pytest.mark.parametrize("kind", [SGAConfig, OGAConfig])
@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("populaton", 25),
        ("type", "sgd"),
        ("population", 1),
        ("population", "25"),
        ("population", 25.0),
        ("population", True),
        ("generations", -1),
        ("tournament", 0),
        ("mutation_rate", 1.01),
        ("mutation_rate", float("nan")),
        ("mutation_rate", "fast"),
        ("elites", -1),
        ("elites", 25),
    ],
)
def test_unknown_ill_typed_and_out_of_range_settings_are_refused(
    kind: type[GenerationalConfig], key: str, value: Any
) -> None:
    with pytest.raises(ValidationError, match=key):
        kind.model_validate({key: value})


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"connection": 1.1}, "connection"),
        ({"inversion": -0.1}, "inversion"),
        ({"cap": 0}, "cap"),
        ({"cap": 33}, "cap"),
        ({"scope": "per_gene"}, "per_operon"),
        ({"initial_operons": "per_parameter"}, "parameter_loci: expected a number"),
        ({"parameter_loci": 4}, "parameter_loci: expected a number"),
    ],
)
def test_impossible_options_are_refused(settings: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        OGAConfig.model_validate(settings)


def test_parameters_must_divide_the_genome() -> None:
    config = OGAConfig(initial_operons=InitialOperons.PER_PARAMETER, parameter_loci=7)
    with pytest.raises(ValueError, match="parameter_loci: expected a divisor of the genome's 24 bits, got 7"):
        config.build(24)


@pytest.mark.parametrize("kind", [SGAConfig, OGAConfig])
def test_every_setting_is_described(kind: type[GenerationalConfig]) -> None:
    properties = kind.model_json_schema()["properties"]
    assert {name for name, schema in properties.items() if not schema.get("description")} <= {"type"}

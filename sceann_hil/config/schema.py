"""The JSON schema of a configuration, so that editors complete keys and check values while one types."""

from __future__ import annotations

import json
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from sceann_hil import registry
from sceann_hil.config.model import ExperimentConfig
from sceann_hil.plugins import PluginConfig
from sceann_hil.registry import Group

_MODE: JsonSchemaMode = "validation"


def json_schema() -> dict[str, Any]:
    """A schema (draft 2020-12) of `ExperimentConfig` with all installed robots, tasks and algorithms.

    Each of these sections is ``oneOf`` the plug-ins' models, told apart by `type`.

    Raises:
        PluginError: a package that brings one of them is broken.
    """
    plugins: dict[Group, list[type[PluginConfig]]] = {
        group: [registry.load(group, name) for name in registry.available(group)] for group in Group
    }
    everything: list[type[BaseModel]] = [ExperimentConfig]
    for models in plugins.values():
        everything += models
    references, schema = models_json_schema([(model, _MODE) for model in everything])
    definitions = schema["$defs"]
    top = definitions.pop(_name(references[ExperimentConfig, _MODE]))
    for group, models in plugins.items():
        section = top["properties"][group.singular]
        base = _name(section.pop("$ref"))
        definitions.pop(base, None)
        section["oneOf"] = [references[model, _MODE] for model in models]
        if group is not Group.ALGORITHMS:
            # other sections have a robot or a task too
            definitions[base] = {"oneOf": section["oneOf"]}
        for model in models:
            definition = definitions[_name(references[model, _MODE])]
            definition["required"] = sorted({"type", *definition.get("required", [])})
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **top,
        "title": "SCEANN experiment",
        "$defs": definitions,
    }


def schema_text() -> str:
    """`json_schema` as ``configs/schema.json`` holds it and ``sceann schema`` prints it."""
    return json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"


def _name(reference: Any) -> str:
    """The definition's name in ``{"$ref": "#/$defs/Name"}`` or ``"#/$defs/Name"``."""
    text: str = reference["$ref"] if isinstance(reference, dict) else reference
    return text.rpartition("/")[2]

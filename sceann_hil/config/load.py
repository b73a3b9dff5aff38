"""From YAML to a validated `ExperimentConfig`, with everything that is wrong told at once."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path as FilePath
from typing import Any

from pydantic import ValidationError

from sceann_hil import registry
from sceann_hil.config.document import Document, parse
from sceann_hil.config.explain import explain
from sceann_hil.config.file import read_text
from sceann_hil.config.model import ExperimentConfig
from sceann_hil.config.overrides import with_overrides
from sceann_hil.config.problems import Place, Problem, any_of, fail, nearest, raise_if_any, shown
from sceann_hil.plugins import PluginConfig, Section
from sceann_hil.registry import Group


def load_config(path: FilePath | str, overrides: Sequence[str] = ()) -> ExperimentConfig:
    """Read and check a configuration file.

    Args:
        path: a YAML file.
        overrides: ``key.sub=value`` settings that replace values of the file, as ``--set`` gives them.

    Raises:
        ConfigError: what is wrong, with file, line, column, key, what was expected and what was found.
        PluginError: a package that brings a robot, task or algorithm is broken.
    """
    return parse_config(read_text(path), str(path), overrides)


StandIn = Callable[[Group, str], type[PluginConfig] | None]
"""What takes the place of a plug-in by its group and name; None if that is installed."""


def parse_config(
    text: str, source: str, overrides: Sequence[str] = (), stand_in: StandIn | None = None
) -> ExperimentConfig:
    """Check a configuration that is not in a file, such as the journal's copy.

    Args:
        text: YAML.
        source: what messages call it.
        overrides: as in `load_config`.
        stand_in: asked for the models of plug-ins that are not installed; without it they are problems.

    Raises:
        ConfigError: as in `load_config`.
        PluginError: as in `load_config`.
    """
    document = parse(text, source)
    start = document.values.get((), Place(0, 1, 1, source))
    if not isinstance(document.data, dict):
        raise_if_any(document.problems)
        keys = ", ".join(ExperimentConfig.model_fields)
        fail(start, f"expected keys ({keys}), got {shown(document.data)}")
    return validated(with_overrides(document, overrides), stand_in)


_PLUGGED: dict[str, Group] = {group.singular: group for group in Group}
_PLAIN: dict[str, type[Section]] = {
    name: field.annotation
    for name, field in ExperimentConfig.model_fields.items()
    if name not in _PLUGGED and isinstance(field.annotation, type) and issubclass(field.annotation, Section)
}


def validated(document: Document, stand_in: StandIn | None = None) -> ExperimentConfig:
    """The configuration that a document of plain data describes.

    Raises:
        ConfigProblems: what is wrong, all at once.
        PluginError: as in `load_config`.
    """
    problems: list[Problem] = []
    models = _section_models(document, problems, stand_in)
    sections: dict[str, Section] = {}
    for name, model in models.items():
        try:
            # Only pydantic's JSON mode is strict about types and yet takes lists as tuples and text as enums.
            sections[name] = model.model_validate_json(json.dumps(document.data[name]))
        except ValidationError as error:
            elsewhere = _keys_of({other: models[other] for other in models if other != name})
            problems += explain(error, model, (name,), document, elsewhere)
    refused = [name for name in (*_PLUGGED, *_PLAIN) if name in document.data and name not in sections]
    try:
        config = ExperimentConfig.model_validate({**document.data, **dict.fromkeys(refused), **sections})
    except ValidationError as error:
        found = explain(error, ExperimentConfig, (), document, _keys_of(models))
        problems += [problem for problem in found if problem.key not in refused]
        raise_if_any(_without_consequences(problems, document.problems))
        raise
    raise_if_any(_without_consequences(problems, document.problems))
    return config


def _without_consequences(problems: list[Problem], unreadable: list[Problem]) -> list[Problem]:
    """No second complaint about a value that could not even be read."""
    known = {(problem.place, problem.key) for problem in unreadable}
    return unreadable + [problem for problem in problems if (problem.place, problem.key) not in known]


def _section_models(document: Document, problems: list[Problem], stand_in: StandIn | None) -> dict[str, type[Section]]:
    """The model of every section that says well enough what it is."""
    models: dict[str, type[Section]] = {}
    for name in (*_PLUGGED, *_PLAIN):
        if name not in document.data:
            continue
        data: Any = document.data[name]
        if not isinstance(data, dict):
            expected = "a section with keys" if name in _PLAIN else "a section with a type"
            place = document.place_of_value((name,))
            problems.append(Problem(place, name, f"expected {expected}, got {shown(data)}"))
        elif name in _PLAIN:
            models[name] = _PLAIN[name]
        elif stand_in is not None and (instead := stand_in(_PLUGGED[name], str(data.get("type")))) is not None:
            models[name] = instead
        else:
            kind = _plugin_type(document, name, problems)
            if kind is not None:
                models[name] = registry.load(_PLUGGED[name], kind)
    return models


def _plugin_type(document: Document, section: str, problems: list[Problem]) -> str | None:
    kinds = registry.available(_PLUGGED[section])
    if "type" not in document.data[section]:
        place = document.place_of_key((section,))
        problems.append(Problem(place, f"{section}.type", f"this key is missing, expected {any_of(kinds)}"))
        return None
    kind = document.data[section]["type"]
    if isinstance(kind, str) and kind in kinds:
        return kind
    near = nearest(kind, kinds) if isinstance(kind, str) else None
    message = f"expected {any_of(kinds)}, got {shown(kind)}" + (f", did you mean {near}?" if near else "")
    problems.append(Problem(document.place_of_value((section, "type")), f"{section}.type", message))
    return None


def _keys_of(models: Mapping[str, type[Section]]) -> list[str]:
    return [f"{name}.{key}" for name, model in models.items() for key in model.model_fields]

"""Configurations from Python values: a mapping instead of a file, and another configuration with some keys changed.

Whatever would be text in YAML may be the Python value: enums, tuples, paths, NumPy numbers and arrays, sections. The
checks and the messages are the file's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path as FilePath
from pathlib import PurePath
from typing import Any

import numpy as np
from pydantic import BaseModel

from sceann_hil.config.document import Document, parse
from sceann_hil.config.file import read_text
from sceann_hil.config.load import validated
from sceann_hil.config.model import ExperimentConfig
from sceann_hil.config.overrides import put, with_overrides
from sceann_hil.config.problems import Path, Place, Problem, dotted, fail, shown

_DEPTH = 20


def config_from(data: Mapping[str, Any], source: str, changes: Mapping[str, Any] | None = None) -> ExperimentConfig:
    """The configuration that a mapping describes.

    Args:
        data: as a YAML file would hold it.
        source: what messages call it.
        changes: values by dotted key that are set on top of it.

    Raises:
        ConfigError: what is wrong with it.
        PluginError: a package that brings a robot, task or algorithm is broken.
    """
    problems: list[Problem] = []
    place = Place(0, 0, 0, source)
    document = Document(source, _plain(data, (), place, problems), values={(): place}, problems=problems)
    return validated(_changed(document, changes or {}))


def changed(config: ExperimentConfig, changes: Mapping[str, Any], settings: Sequence[str] = ()) -> ExperimentConfig:
    """See `ExperimentConfig.with_changes`."""
    source = "the changed configuration"
    document = Document(source, config.model_dump(mode="json"), values={(): Place(0, 0, 0, source)})
    return validated(with_overrides(_changed(document, changes), settings))


BESIDE_ROBOT = ("operator", "budget", "suspenders")
"""Sections that belong to a robot more than to what it does: who stands beside it, and what it can take."""


def with_robot_of(config: ExperimentConfig, path: FilePath) -> ExperimentConfig:
    """`config` on the robot of a YAML file, which may hold no more than its section `robot`.

    Sections that are about working with that robot (`BESIDE_ROBOT`) hold too where the file has them.

    Raises:
        ConfigError: the file cannot be read or has no robot, or the robot does not suit the rest.
    """
    written = parse(read_text(path), str(path))
    robot = written.data.get("robot") if isinstance(written.data, dict) else None
    if not isinstance(robot, dict):
        fail(Place(0, 0, 0, str(path)), f"expected a section robot, got {shown(robot)}")
    document = Document(str(path), config.model_dump(mode="json"))
    for name in ("robot", *BESIDE_ROBOT):
        if name == "robot" or isinstance(written.data.get(name), dict):
            put(document, (name,), written.below((name,)), written.place_of_key((name,)))
    return validated(document)


def _changed(document: Document, changes: Mapping[str, Any]) -> Document:
    """`document` itself, in which every value of `changes` stands at its dotted key."""
    for number, (key, value) in enumerate(changes.items(), start=1):
        place = Place(number, 0, 0, f"change of {key}")
        path: Path = tuple(key.split("."))
        if not all(path):
            document.problems.append(Problem(place, "", "expected a key such as seed or algorithm.population"))
            continue
        problems: list[Problem] = []
        plain = _plain(value, path, place, problems)
        put(document, path, Document(place.source, plain, values={(): place}, problems=problems), place)
    return document


def _plain(value: Any, path: Path, place: Place, problems: list[Problem]) -> Any:
    """`value` as YAML would hold it; what has no such form is a problem."""
    if len(path) > _DEPTH:
        problems.append(Problem(place, dotted(path[:3]), f"nested more than {_DEPTH} levels deep"))
        return None
    match value:
        case Enum():
            return _plain(value.value, path, place, problems)
        case None | bool() | int() | float() | str():
            return value
        case BaseModel():
            return value.model_dump(mode="json")
        case Mapping():
            found: dict[str, Any] = {}
            for key, inner in value.items():
                if isinstance(key, str):
                    found[key] = _plain(inner, (*path, key), place, problems)
                else:
                    problems.append(Problem(place, dotted(path), f"expected text as key, got {key!r:.40}"))
            return found
        case np.generic() | np.ndarray():
            return _plain(value.tolist(), path, place, problems)
        case list() | tuple() | range():
            return [_plain(inner, (*path, index), place, problems) for index, inner in enumerate(value)]
        case PurePath():
            return str(value)
    kind = type(value).__name__
    problems.append(Problem(place, dotted(path), f"expected what YAML can hold, got an object of type {kind}"))
    return None

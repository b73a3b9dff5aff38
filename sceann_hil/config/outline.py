"""What a configuration names, read without its plug-ins: a run can be looked at where they are not installed."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError

from sceann_hil import registry
from sceann_hil.config.document import parse
from sceann_hil.errors import PluginError
from sceann_hil.plugins import AlgorithmConfig
from sceann_hil.registry import Group


@dataclass(frozen=True, slots=True)
class Outline:
    """The outline of a configuration.

    Attributes:
        task: its type.
        robot: its type.
        algorithm: its type.
        coding: how genomes code connections.
        population: individuals per generation.
        generations: generations after the initial one.
        keeps_best: the algorithm keeps its best unchanged; no if its plug-in is not there to be asked.
    """

    task: str
    robot: str
    algorithm: str
    coding: str
    population: int
    generations: int
    keeps_best: bool


def outline_of(text: str, source: str) -> Outline:
    """The outline of a canonical configuration, as `sceann_hil.config.dump_config` wrote it into a journal.

    Args:
        text: YAML with every default spelled out.
        source: what messages call it.

    Raises:
        ConfigError: it is not YAML.
        ValueError: it is not such a configuration.
    """
    data: Any = parse(text, source).data
    try:
        return Outline(
            task=str(data["task"]["type"]),
            robot=str(data["robot"]["type"]),
            algorithm=str(data["algorithm"]["type"]),
            coding=str(data["controller"]["coding"]),
            population=int(data["algorithm"]["population"]),
            generations=int(data["algorithm"]["generations"]),
            keeps_best=_keeps_best(data["algorithm"]),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{source}: expected a canonical configuration, got none: {error!r}") from error


def _keeps_best(section: Any) -> bool:
    try:
        model = registry.load(Group.ALGORITHMS, str(section["type"]))
        algorithm = model.model_validate_json(json.dumps(section))
    except (PluginError, ValidationError):
        return False
    return isinstance(algorithm, AlgorithmConfig) and algorithm.keeps_best

"""What a configuration names, read without its plug-ins: a run can be looked at where they are not installed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sceann_hil.config.document import parse


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
    """

    task: str
    robot: str
    algorithm: str
    coding: str
    population: int
    generations: int


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
        )
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{source}: expected a canonical configuration, got none: {error!r}") from error

"""``--set key.sub=value``: values from the command line, put into a document before it is validated."""

from __future__ import annotations

from collections.abc import Sequence
from copy import deepcopy
from typing import Any

from sceann_hil.config.document import Document, parse
from sceann_hil.config.problems import Path, Place, Problem, dotted, shown


def with_overrides(document: Document, overrides: Sequence[str]) -> Document:
    """A document in which every ``key.sub=value`` of `overrides` was set, the last one winning.

    Values are YAML, so ``task.start_m=[0.1, 0.2]`` and ``algorithm={type: oga}`` work. Missing sections on
    the way are made; whether the keys exist is for the validation to say. What cannot be set becomes a
    problem of the document.

    Raises:
        ConfigError: a value is not YAML.
    """
    result = Document(
        document.source,
        deepcopy(document.data),
        dict(document.keys),
        dict(document.values),
        list(document.problems),
    )
    for number, override in enumerate(overrides, start=1):
        _set(result, override, Place(number, 0, 0, f"--set {override}"))
    return result


def _set(document: Document, override: str, place: Place) -> None:
    key, equals, text = override.partition("=")
    path: Path = tuple(part.strip() for part in key.split("."))
    if not equals or not all(path):
        document.problems.append(Problem(place, "", "expected key=value or section.key=value"))
        return
    section: Any = document.data
    for depth, part in enumerate(path[:-1], start=1):
        if section.get(part) is None:
            section[part] = {}
        section = section[part]
        if not isinstance(section, dict):
            what = f"{dotted(path[:depth])} is {shown(section)}, not a section with keys"
            document.problems.append(Problem(place, "", f"{what}; set it as a whole"))
            return
    value = parse(text, place.source, place.override)
    _forget(document, path)
    section[path[-1]] = value.data
    for depth in range(1, len(path) + 1):
        document.keys.setdefault(path[:depth], place)
        document.values.setdefault(path[:depth], place)
    for inner in value.values:
        document.values[path + inner] = place
    for inner in value.keys:
        document.keys[path + inner] = place
    document.problems.extend(Problem(place, dotted(path), problem.message) for problem in value.problems)


def _forget(document: Document, path: Path) -> None:
    """Drop the places, and the problems, of what an override replaces."""
    for places in (document.keys, document.values):
        for inner in [inner for inner in places if inner[: len(path)] == path]:
            del places[inner]

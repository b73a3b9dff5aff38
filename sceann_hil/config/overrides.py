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
    value = parse(text, place.source, place.override)
    here = Document(
        place.source,
        value.data,
        dict.fromkeys(value.keys, place),
        dict.fromkeys(value.values, place),
        [Problem(place, dotted(path), problem.message) for problem in value.problems],
    )
    put(document, path, here, place)


def put(document: Document, path: Path, value: Document, place: Place) -> None:
    """Replace one value of `document`, in place; missing sections on the way are made.

    Args:
        document: its data must not be shared with another document.
        path: where to.
        value: the new value, with its places.
        place: who asks for it.
    """
    section: Any = document.data
    for depth, part in enumerate(path[:-1], start=1):
        if section.get(part) is None:
            section[part] = {}
        section = section[part]
        if not isinstance(section, dict):
            what = f"{dotted(path[:depth])} is {shown(section)}, not a section with keys"
            document.problems.append(Problem(place, "", f"{what}; set it as a whole"))
            return
    _forget(document, path)
    section[path[-1]] = value.data
    for depth in range(1, len(path) + 1):
        document.keys.setdefault(path[:depth], place)
        document.values.setdefault(path[:depth], place)
    for inner, inner_place in value.values.items():
        document.values[path + inner] = inner_place
    for inner, inner_place in value.keys.items():
        document.keys[path + inner] = inner_place
    document.problems.extend(value.problems)


def _forget(document: Document, path: Path) -> None:
    """Drop the places, and the problems, of what an override replaces."""
    for places in (document.keys, document.values):
        for inner in [inner for inner in places if inner[: len(path)] == path]:
            del places[inner]

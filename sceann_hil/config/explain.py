"""What pydantic found, said to a person: the place, what was expected, what stands there, what is near."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from sceann_hil.config.document import Document
from sceann_hil.config.problems import Path, Problem, any_of, dotted, nearest, shown
from sceann_hil.plugins import Misfit

_SECTION_TYPES = {"model_type", "model_attributes_type", "dict_type", "dataclass_type"}
_TYPES = {
    "int_type": "a whole number",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "float_parsing": "a number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "bool_parsing": "true or false",
    "string_type": "text",
    "list_type": "a list",
    "tuple_type": "a list",
    "none_required": "nothing",
} | dict.fromkeys(_SECTION_TYPES, "a section with keys")
_LIMITS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "greater_than": lambda limit: f"more than {limit['gt']}",
    "greater_than_equal": lambda limit: f"at least {limit['ge']}",
    "less_than": lambda limit: f"less than {limit['lt']}",
    "less_than_equal": lambda limit: f"at most {limit['le']}",
    "multiple_of": lambda limit: f"a multiple of {limit['multiple_of']}",
    "enum": lambda limit: limit["expected"],
    "literal_error": lambda limit: limit["expected"],
    "string_too_short": lambda limit: f"text of at least {limit['min_length']} characters",
    "string_too_long": lambda limit: f"text of at most {limit['max_length']} characters",
    "string_pattern_mismatch": lambda limit: f"text of the form {limit['pattern']}",
    "too_short": lambda limit: f"at least {limit['min_length']} values",
    "too_long": lambda limit: f"at most {limit['max_length']} values",
}


def explain(
    error: ValidationError,
    model: type[BaseModel],
    section: Path,
    document: Document,
    elsewhere: Iterable[str],
) -> list[Problem]:
    """Problems of one section.

    Args:
        error: what `model` had to say of the section.
        model: the section's model.
        section: the section's path.
        document: where the data come from.
        elsewhere: dotted keys of other sections, for a key that is only in the wrong place.
    """
    explainer = _Explainer(model, section, document, tuple(elsewhere))
    return explainer.explain(error.errors(include_url=False))


class _Explainer:
    def __init__(self, model: type[BaseModel], section: Path, document: Document, elsewhere: tuple[str, ...]) -> None:
        self._model = model
        self._section = section
        self._document = document
        self._elsewhere = elsewhere

    def explain(self, errors: list[ErrorDetails]) -> list[Problem]:
        problems, rest = self._sorted_out(errors)
        return problems + [problem for error in rest for problem in self._explain_one(error, rest)]

    def _sorted_out(self, errors: list[ErrorDetails]) -> tuple[list[Problem], list[ErrorDetails]]:
        """Values of none of the types that they may have, and the errors of the types that were meant, however deep
        one choice of types stands inside another."""
        by_value: dict[Path, dict[str, list[ErrorDetails]]] = {}
        for error in errors:
            path, tried = self._follow(error)
            by_value.setdefault(path, {}).setdefault(tried, []).append(error)
        problems, rest = [], []
        for tried_types in by_value.values():
            meant = self._meant(tried_types)
            if not meant:
                problems.append(self._wrong_type([error for errors in tried_types.values() for error in errors]))
            elif self._follow(meant[0])[1]:
                deeper = self._sorted_out([self._without_first_type(error) for error in meant])
                problems += deeper[0]
                rest += deeper[1]
            else:
                rest += meant
        return problems, rest

    def _without_first_type(self, error: ErrorDetails) -> ErrorDetails:
        """The same error at a location without the first type that was tried."""
        path, _ = self._follow(error)
        place = len(path) - len(self._section)
        location = error["loc"]
        return {**error, "loc": (*location[:place], *location[place + 1 :])}

    def _follow(self, error: ErrorDetails) -> tuple[Path, str]:
        """The path up to the first part of a location that is not in the data: the type that was tried."""
        path, value = self._section, self._value(self._section)
        for part in _location(error):
            if not _has(value, part):
                return path, str(part)
            path, value = (*path, part), value[part]
        return path, ""

    def _path(self, error: ErrorDetails) -> Path:
        """The path of an error's value in the data, without the names of the types that were tried."""
        path, value = self._section, self._value(self._section)
        for part in _location(error):
            if _has(value, part):
                path, value = (*path, part), value[part]
        return path

    def _meant(self, tried_types: dict[str, list[ErrorDetails]]) -> list[ErrorDetails]:
        """Of the types that one value was tried as, the errors of the one that was probably meant."""
        right_kind = [
            errors
            for tried, errors in tried_types.items()
            if not (tried and errors[0]["type"] in _TYPES and self._path(errors[0]) == self._follow(errors[0])[0])
        ]
        meant = min(right_kind, key=len, default=[])
        if "" not in tried_types and any(self._is_unknown_here(error) for error in meant):
            return [error for error in meant if error["type"] != "missing"]
        return meant

    def _is_unknown_here(self, error: ErrorDetails) -> bool:
        """An unknown key of the very value whose types were tried, not of one inside it."""
        return error["type"] == "extra_forbidden" and self._path(error)[:-1] == self._follow(error)[0]

    def _explain_one(self, error: ErrorDetails, errors: list[ErrorDetails]) -> list[Problem]:
        path, kind, context = self._path(error), error["type"], error.get("ctx", {})
        if kind == "extra_forbidden":
            return [self._unknown_key(path)]
        if kind == "missing":
            name = error["loc"][-1]
            if isinstance(name, str):
                return [] if self._is_misspelt(path, name) else [self._missing_key(path, name)]
            indices = [other["loc"][-1] for other in errors if other["type"] == "missing" and self._path(other) == path]
            return [self._mismatch(path, f"{max(int(index) for index in indices) + 1} values")]
        if kind in ("value_error", "assertion_error"):
            return [self._misfit(path, context["error"])]
        if kind in _LIMITS:
            return [self._mismatch(path, _LIMITS[kind](context))]
        return [self._mismatch(path, _TYPES.get(kind) or error["msg"].removeprefix("Input should be "))]

    def _is_misspelt(self, section: Path, key: str) -> bool:
        """An unknown key in the section looks like this one."""
        keys = self._keys(section)
        return any(nearest(other, keys) == key for other in self._value(section) if other not in keys)

    def _unknown_key(self, path: Path) -> Problem:
        section, key = path[:-1], str(path[-1])
        keys = self._keys(section)
        near = nearest(key, keys)
        meant = (
            dotted((*section, near))
            if near
            else next((other for other in self._elsewhere if other.rpartition(".")[2] == key), None)
        )
        message = "unknown key" + (f", did you mean {meant}?" if meant else ",")
        message += f" Expected {any_of(sorted(keys))}" if meant else f" expected {any_of(sorted(keys))}"
        return Problem(self._document.place_of_key(path), dotted(path), message)

    def _missing_key(self, section: Path, key: str) -> Problem:
        return Problem(
            self._document.place_of_key(section),
            dotted((*section, key)),
            "this key is missing and has no default",
        )

    def _wrong_type(self, errors: list[ErrorDetails]) -> Problem:
        path = self._path(errors[0])
        expected = [_TYPES[error["type"]] for error in errors if error["type"] not in _SECTION_TYPES]
        if len(expected) < len(errors):
            expected.append(f"a section with {any_of(sorted(self._keys(path)))}")
        return self._mismatch(path, any_of(dict.fromkeys(expected)))

    def _mismatch(self, path: Path, expected: str) -> Problem:
        value = self._value(path)
        message = f"expected {expected}, got {shown(value)}"
        if isinstance(value, str):
            near = nearest(value, [word.strip("'") for word in expected.replace(" or ", ", ").split(", ")])
            if near and f"'{near}'" in expected:
                message += f", did you mean {near}?"
            if expected == "true or false" and value.lower() in ("yes", "on", "no", "off", "y", "n"):
                message += f" (write {'true' if value.lower() in ('yes', 'on', 'y') else 'false'})"
        elif expected == "text" and isinstance(value, (bool, int, float)):
            message += f' (put it in quotes: "{shown(value)}")'
        return Problem(self._document.place_of_value(path), dotted(path), message)

    def _misfit(self, path: Path, error: Exception) -> Problem:
        """A model's own complaint, with the lines of all keys that it names."""
        named = error.keys if isinstance(error, Misfit) else ()
        keys: list[Path] = [(*path, *key.split(".")) for key in named]
        start, colon, rest = str(error).partition(": ")
        if not keys and colon and start in self._keys(path):
            keys = [(*path, start)]
        if len(keys) < 2:
            key = keys[0] if keys else path
            message = rest if colon and keys and start == key[-1] else str(error)
            return Problem(self._document.place_of_value(key), dotted(key), message)
        place = next((self._document.values[key] for key in keys if key in self._document.values), None)
        names = [f"{dotted(key)} ({self._whereabouts(key)})" for key in keys]
        return Problem(place or self._document.place_of_value(path), "", f"{' and '.join(names)}: {error}")

    def _whereabouts(self, path: Path) -> str:
        return self._document.values[path].short if path in self._document.values else "by default"

    def _value(self, path: Path) -> Any:
        value = self._document.data
        for part in path:
            value = value[part]
        return value

    def _keys(self, path: Path) -> set[str]:
        """The keys that may stand in the section at `path`, whichever of several models it is."""
        models = {self._model}
        for part in path[len(self._section) :]:
            if isinstance(part, str):
                fields = [model.model_fields[part] for model in models if part in model.model_fields]
                models = {model for field in fields for model in _models_in(field.annotation)}
        return {key for model in models for key in model.model_fields}


def _location(error: ErrorDetails) -> Path:
    """An error's location without the name of the key or item that is missing."""
    return error["loc"][:-1] if error["type"] == "missing" else error["loc"]


def _has(value: Any, part: str | int) -> bool:
    if isinstance(value, list):
        return isinstance(part, int) and part < len(value)
    return isinstance(value, dict) and part in value


def _models_in(annotation: Any) -> set[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return {annotation}
    return {model for inner in get_args(annotation) for model in _models_in(inner)}

"""A study's YAML: a base experiment, axes that vary its keys, and how often each condition is run.

Checked as strictly as an experiment's (`sceann_hil.config`), for every condition of the grid, before anything runs.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path as FilePath
from typing import Annotated, Any

from pydantic import Field, ValidationError

from sceann_hil.config import ExperimentConfig, parse_config
from sceann_hil.config.document import Document, parse
from sceann_hil.config.explain import explain
from sceann_hil.config.file import read_text
from sceann_hil.config.load import validated
from sceann_hil.config.model import MAX_SEED
from sceann_hil.config.overrides import put, with_overrides
from sceann_hil.config.problems import ConfigProblems, Place, Problem, fail, raise_if_any, shown
from sceann_hil.plugins import Section
from sceann_hil.study.condition import Condition, Setting, setting_text

MAX_CONDITIONS = 100_000
"""Largest grid: a slip of the pen, not a study, has more."""


class StudyConfig(Section):
    """The keys of a study's file."""

    name: Annotated[str, Field(max_length=80, pattern=r"^[A-Za-z0-9]([A-Za-z0-9 ._-]*[A-Za-z0-9])?$")]
    """What the study is called: letters, digits, spaces and . _ - inside."""
    about: str = ""
    """One or two sentences for its readers; the report prints them."""
    seed: Annotated[int, Field(ge=0, le=MAX_SEED)] = 1
    """Root of the seed tree of all its runs."""
    runs: Annotated[int, Field(ge=1, le=1_000_000)] = 50
    """Independent runs of each condition."""
    base: dict[str, Any]
    """An experiment; the axes replace some of its values."""
    grid: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(default_factory=dict)
    """Axes: a dotted key of the experiment and the values that it takes. Every combination is a condition."""


@dataclass(frozen=True, slots=True)
class Study:
    """A study that has been checked.

    Attributes:
        config: what was written.
        conditions: every combination of the axes' values.
    """

    config: StudyConfig
    conditions: tuple[Condition, ...]

    @property
    def written(self) -> dict[str, Any]:
        """What decides the study's numbers, as it was written. The number of runs is not part of it: run k is the
        same run however many there are."""
        return {"seed": self.config.seed, "base": self.config.base, "grid": self.config.grid}


def load_study(path: FilePath | str, overrides: Sequence[str] = ()) -> Study:
    """Read and check a study's file.

    Args:
        path: a YAML file.
        overrides: ``key.sub=value`` settings that replace values of the file.

    Raises:
        ConfigError: what is wrong, with file, line, column, key or axis, what was expected and what was found.
        PluginError: a package that brings a robot, task or algorithm is broken.
    """
    return parse_study(read_text(path), str(path), overrides)


def parse_study(text: str, source: str, overrides: Sequence[str] = ()) -> Study:
    """Check a study that is not in a file; arguments and errors as in `load_study`."""
    document = parse(text, source)
    if not isinstance(document.data, dict):
        raise_if_any(document.problems)
        start = document.values.get((), Place(0, 1, 1, source))
        fail(start, f"expected keys ({', '.join(StudyConfig.model_fields)}), got {shown(document.data)}")
    document = with_overrides(document, overrides)
    try:
        config = StudyConfig.model_validate_json(json.dumps(document.data))
    except ValidationError as error:
        raise_if_any([*document.problems, *explain(error, StudyConfig, (), document, ())])
        raise
    raise_if_any([*document.problems, *_axis_problems(config, document)])
    return Study(config, _conditions(config, document))


def study_schema_text() -> str:
    """A JSON schema (draft 2020-12) of a study's file, as ``configs/paper/schema.json`` holds it."""
    schema = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **StudyConfig.model_json_schema(),
        "title": "SCEANN study",
    }
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def load_conditions(path: FilePath | str, overrides: Sequence[str] = ()) -> tuple[str, tuple[Condition, ...]]:
    """A name and the conditions of a study's file, or the one condition of an experiment's; errors as in
    `load_study`. Conditions keep the file's seed here."""
    text = read_text(path)
    document = parse(text, str(path))
    if isinstance(document.data, dict) and "base" not in document.data:
        config = parse_config(text, str(path), overrides)
        one = Condition(0, (), config.model_copy(update={"name": None}))
        return config.name or FilePath(path).stem, (one,)
    study = parse_study(text, str(path), overrides)
    seed = {"seed": study.config.seed}
    return study.config.name, tuple(replace(c, config=c.config.model_copy(update=seed)) for c in study.conditions)


def _axis_problems(config: StudyConfig, document: Document) -> Iterator[Problem]:
    """What is wrong with the axes whatever their values mean."""
    for key in ("name", "seed"):
        if key in config.base:
            yield Problem(document.place_of_key(("base", key)), f"base.{key}", f"a study has its own {key}; remove it")
    for axis, values in config.grid.items():
        place = document.place_of_key(("grid", axis))
        path = axis.split(".")
        if path[0] in ("name", "seed"):
            yield Problem(place, f"grid.{axis}", f"{path[0]} cannot be an axis: every run has a seed of its own")
        for other in config.grid:
            if other != axis and other.split(".") == path[: len(other.split("."))]:
                yield Problem(place, f"grid.{axis}", f"the axis {other} replaces this key as well; keep one of the two")
        for index, value in enumerate(values):
            if value in values[:index]:
                where = document.place_of_value(("grid", axis, index))
                yield Problem(where, f"grid.{axis}", f"{shown(value)} is on this axis already")
    n_conditions = 1
    for values in config.grid.values():
        n_conditions *= len(values)
    if n_conditions > MAX_CONDITIONS:
        place = document.place_of_key(("grid",))
        yield Problem(place, "grid", f"expected at most {MAX_CONDITIONS} conditions, got {n_conditions}")


def _conditions(config: StudyConfig, document: Document) -> tuple[Condition, ...]:
    base = replace(document.below(("base",)), problems=[])
    conditions: list[Condition] = []
    problems: list[Problem] = []
    known: dict[int, Condition] = {}
    choices = [[(axis, index) for index in range(len(values))] for axis, values in config.grid.items()]
    for number, chosen in enumerate(itertools.product(*choices)):
        settings: tuple[Setting, ...] = tuple((axis, config.grid[axis][index]) for axis, index in chosen)
        try:
            condition = Condition(number, settings, _experiment(base, document, chosen))
        except ConfigProblems as error:
            problems += [_named(problem, document, settings) for problem in error.problems]
            continue
        twin = known.setdefault(condition.identity, condition)
        if twin is not condition:
            problems.append(
                Problem(
                    document.place_of_key(("grid",)),
                    "grid",
                    f"the conditions [{twin.label}] and [{condition.label}] are the same experiment",
                )
            )
        conditions.append(condition)
    raise_if_any(problems)
    return tuple(conditions)


def _experiment(base: Document, study: Document, chosen: Sequence[tuple[str, int]]) -> ExperimentConfig:
    document = replace(
        base,
        data=deepcopy(base.data),
        keys=dict(base.keys),
        values=dict(base.values),
        problems=list(base.problems),
    )
    for axis, index in chosen:
        value = replace(study.below(("grid", axis, index)), problems=[])
        put(document, tuple(axis.split(".")), value, study.place_of_key(("grid", axis)))
    return validated(document).model_copy(update={"name": None, "seed": 0})


def _named(problem: Problem, document: Document, settings: Sequence[Setting]) -> Problem:
    """The problem, naming the axis if its value stands on one."""
    for axis, value in settings:
        if problem.place == document.place_of_key(("grid", axis)):
            return replace(problem, message=f"{problem.message}, on the axis {axis}")
        if problem.place in [place for path, place in document.values.items() if path[:2] == ("grid", axis)]:
            where = "" if isinstance(value, dict) else f" ({setting_text(axis, value)})"
            return replace(problem, message=f"{problem.message}, on the axis {axis}{where}")
    return problem

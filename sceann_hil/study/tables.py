"""A study as tables for other programs: CSV, or Parquet where it is large."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np

from sceann_hil.errors import PackageMissing, RunExists
from sceann_hil.study.condition import Condition
from sceann_hil.study.store import StudyReader

Columns = Mapping[str, Sequence[Any]]
"""Equally long columns by name."""


class Format(StrEnum):
    """How tables are written."""

    CSV = "csv"
    """Text that every program reads."""
    PARQUET = "parquet"
    """Columns of numbers, a tenth of the size."""


def export_study(reader: StudyReader, folder: Path, form: Format = Format.CSV) -> list[Path]:
    """Write ``conditions``, ``runs`` and ``best`` (best fitness of every generation of every run).

    A table appears once it is whole: whatever ends the export leaves nothing that looks like one.

    Args:
        reader: the study, finished or not.
        folder: made if it is missing.
        form: of the files.

    Returns:
        The files written.

    Raises:
        RunExists: one of them is there already.
        PackageMissing: the format needs a package that is not installed.
    """
    conditions = reader.conditions()
    axes = [axis for axis, _ in conditions[0].settings]
    parts: dict[str, Iterator[Columns]] = {
        "conditions": iter([_conditions(conditions, axes)]),
        "runs": (_runs(reader, condition, axes) for condition in conditions),
        "best": (_best(reader, condition) for condition in conditions),
    }
    paths = {name: folder / f"{name}.{form}" for name in parts}
    for path in paths.values():
        if path.exists():
            raise RunExists(f"{path} exists already; nothing was overwritten.", "Choose another --out.")
    folder.mkdir(parents=True, exist_ok=True)
    about = {"study": reader.name, "seed": str(reader.seed), **reader.versions}
    for name, path in paths.items():
        unfinished = path.with_suffix(".part")
        try:
            with _Csv(unfinished) if form is Format.CSV else _Parquet(unfinished, about) as table:
                for columns in parts[name]:
                    table.write(columns)
            unfinished.replace(path)
        finally:
            with suppress(OSError):
                unfinished.unlink(missing_ok=True)
    return list(paths.values())


def _conditions(conditions: Sequence[Condition], axes: Sequence[str]) -> Columns:
    return {
        "condition": [condition.number for condition in conditions],
        "identity": [f"{condition.identity:016x}" for condition in conditions],
        **{axis: [_text(dict(condition.settings)[axis]) for condition in conditions] for axis in axes},
        "label": [condition.label for condition in conditions],
        "config": [condition.text for condition in conditions],
    }


def _runs(reader: StudyReader, condition: Condition, axes: Sequence[str]) -> Columns:
    runs, n_trials = reader.runs(condition.number), condition.config.build_task().n_trials
    settings = dict(condition.settings)
    return {
        "condition": [condition.number] * len(runs),
        **{axis: [_text(settings[axis])] * len(runs) for axis in axes},
        "run": runs.numbers.tolist(),
        "seed": [int(seed) for seed in runs.seeds],
        "fitness": runs.fitness.tolist(),
        "successes": runs.successes.tolist(),
        "trials": [n_trials] * len(runs),
        "genome": list(runs.genomes),
    }


def _best(reader: StudyReader, condition: Condition) -> Columns:
    runs = reader.runs(condition.number)
    length = runs.best.shape[1]
    return {
        "condition": [condition.number] * runs.best.size,
        "run": np.repeat(runs.numbers, length).tolist(),
        "generation": np.tile(np.arange(length), len(runs)).tolist(),
        "best": runs.best.ravel().astype(np.float64).tolist(),
    }


def _text(value: Any) -> str:
    return json.dumps(value) if isinstance(value, (dict, list)) else str(value)


class _Table(Protocol):
    def write(self, columns: Columns) -> None: ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class _Csv:
    def __init__(self, path: Path) -> None:
        self._file = path.open("w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._file)
        self._begun = False

    def write(self, columns: Columns) -> None:
        if not self._begun:
            self._writer.writerow(columns)
            self._begun = True
        self._writer.writerows(zip(*columns.values(), strict=True))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()


class _Parquet:
    def __init__(self, path: Path, about: Mapping[str, str]) -> None:
        try:
            self._arrow = import_module("pyarrow")
            self._parquet = import_module("pyarrow.parquet")
        except ImportError as error:
            raise PackageMissing(
                f"--format parquet needs the package pyarrow, which is not installed ({error}).",
                "pip install 'sceann-hil[parquet]'",
            ) from None
        self._path = path
        self._about = about
        self._writer: Any = None

    def write(self, columns: Columns) -> None:
        table = self._arrow.table({name: list(values) for name, values in columns.items()})
        if self._writer is None:
            schema = table.schema.with_metadata(dict(self._about))
            self._writer = self._parquet.ParquetWriter(self._path, schema)
        self._writer.write_table(table.cast(self._writer.schema))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._writer is not None:
            self._writer.close()

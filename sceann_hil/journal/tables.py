"""A run's journal as CSV files, for people who want a table."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sceann_hil.errors import RunExists
from sceann_hil.journal.reader import JournalReader
from sceann_hil.journal.rows import AttemptRow, GenerationRow, IndividualRow
from sceann_hil.journal.schema import FIRST_WITH_CHECKSUMS, columns_of
from sceann_hil.places import make_folder

_OF_TABLE = {"start": "start", "own_genome": "genome"}
_TRIAL_COLUMNS = [_OF_TABLE.get(name, name) for name in columns_of("attempt") if not name.endswith("_at")]


def export_csv(reader: JournalReader, folder: Path) -> list[Path]:
    """Write ``generations.csv``, ``individuals.csv`` and ``trials.csv``; all of them, or none.

    Args:
        reader: the run's journal.
        folder: made if it is missing.

    Returns:
        The files written.

    Raises:
        RunExists: one of them is there already.
        RunIsDamaged: a row is not as it was written.
    """
    generations = reader.generations()
    individuals = (row for generation in generations for row in reader.individuals(generation.number))
    tables: dict[str, tuple[list[str], Iterable[Iterable[object]]]] = {
        "generations": (_names(GenerationRow), map(_cells, generations)),
        "individuals": (_names(IndividualRow), map(_cells, individuals)),
        "trials": (_TRIAL_COLUMNS, _trials(reader)),
    }
    paths = {name: folder / f"{name}.csv" for name in tables}
    for path in paths.values():
        if path.exists():
            raise RunExists(f"{path} exists already; nothing was overwritten.", "Choose another --out.")
    make_folder(folder)
    making = {name: folder / f".{name}.csv.new" for name in tables}
    try:
        for name, (columns, rows) in tables.items():
            with making[name].open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(columns)
                writer.writerows(rows)
        for name, path in paths.items():
            making[name].rename(path)
    finally:
        for path in making.values():
            path.unlink(missing_ok=True)
    return list(paths.values())


def _trials(reader: JournalReader) -> Iterator[Iterable[object]]:
    """Rows of the table as they are, without objects in between: there may be millions."""
    if reader.schema_version < FIRST_WITH_CHECKSUMS:
        for generation in reader.generations():
            yield from map(_attempt_cells, reader.attempts(generation.number))
        return
    starts = {identity: " ".join(map(repr, values)) for identity, values in reader.starts().items()}
    names = columns_of("attempt")
    for rows in reader.all_rows("attempt", "id"):
        columns: dict[str, Sequence[Any]] = dict(zip(names, zip(*rows, strict=True), strict=True))
        columns["start"] = [starts[identity] for identity in columns["start"]]
        columns["noise_key"] = np.array(columns["noise_key"], np.int64).view(np.uint64).tolist()
        columns["final_state"] = [text and text[1:-1].replace(",", " ") for text in columns["final_state"]]
        yield from zip(*(columns[name] for name in names if not name.endswith("_at")), strict=True)


def _attempt_cells(row: AttemptRow) -> list[object]:
    return [_cell(getattr(row, name)) for name in _TRIAL_COLUMNS]


def _names(kind: type) -> list[str]:
    return [field.name for field in fields(kind)]


def _cells(row: Any) -> list[object]:
    return [_cell(getattr(row, name)) for name in _names(type(row))]


def _cell(value: object) -> object:
    if isinstance(value, tuple):
        return " ".join(map(repr, value))
    return value.name.lower() if hasattr(value, "name") else value

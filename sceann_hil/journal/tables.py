"""A run's journal as CSV files, for people who want a table."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path

from sceann_hil.errors import RunExists
from sceann_hil.journal import AttemptKind, AttemptRow, GenerationRow, IndividualRow, JournalReader


def export_csv(reader: JournalReader, folder: Path) -> list[Path]:
    """Write ``generations.csv``, ``individuals.csv`` and ``trials.csv``.

    If there are trials outside evolution (reference runs, measurements), they are in ``measurements.csv``.

    Args:
        reader: the run's journal.
        folder: made if it is missing.

    Returns:
        The files written.

    Raises:
        RunExists: one of them is there already.
    """
    generations = reader.generations()
    tables: dict[str, tuple[type, Iterable[object]]] = {
        "generations": (GenerationRow, generations),
        "individuals": (IndividualRow, (row for g in generations for row in reader.individuals(g.number))),
        "trials": (AttemptRow, (row for g in generations for row in reader.attempts(g.number))),
    }
    outside = [
        row for kind in (AttemptKind.REFERENCE, AttemptKind.MEASUREMENT) for row in reader.attempts_of_kind(kind)
    ]
    if outside:
        tables["measurements"] = AttemptRow, sorted(outside, key=lambda row: row.id)
    paths = {name: folder / f"{name}.csv" for name in tables}
    for path in paths.values():
        if path.exists():
            raise RunExists(f"{path} exists already; nothing was overwritten.", "Choose another --out.")
    folder.mkdir(parents=True, exist_ok=True)
    for name, (kind, rows) in tables.items():
        columns = [field.name for field in fields(kind)]
        with paths[name].open("x", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(columns)
            writer.writerows([_cell(getattr(row, column)) for column in columns] for row in rows)
    return list(paths.values())


def _cell(value: object) -> object:
    if isinstance(value, tuple):
        return " ".join(map(repr, value))
    return value.name.lower() if hasattr(value, "name") else value

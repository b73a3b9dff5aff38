"""A run's journal as CSV files, for people who want a table."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sceann_hil.errors import RunExists
from sceann_hil.journal.reader import JournalReader
from sceann_hil.journal.rows import AttemptRow, GenerationRow
from sceann_hil.journal.schema import FIRST_WITH_CHECKSUMS, columns_of
from sceann_hil.places import make_folder

_OF_TABLE = {"start": "start", "own_genome": "genome"}
_NEEDS_QUOTES = re.compile('[",\r\n]')
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
    tables: dict[str, tuple[list[str], Iterable[str]]] = {
        "generations": (_names(GenerationRow), map(_line, map(_cells, reader.generations()))),
        "individuals": (columns_of("individual"), map(_lines, reader.all_columns("individual", "id"))),
        "trials": (_TRIAL_COLUMNS, _trials(reader)),
    }
    paths = {name: folder / f"{name}.csv" for name in tables}
    for path in paths.values():
        if path.exists():
            raise RunExists(f"{path} exists already; nothing was overwritten.", "Choose another --out.")
    make_folder(folder)
    making = {name: folder / f".{name}.csv.new" for name in tables}
    try:
        for name, (columns, lines) in tables.items():
            with making[name].open("w", newline="", encoding="utf-8") as file:
                file.write(_line(columns))
                file.writelines(lines)
        for name, path in paths.items():
            making[name].rename(path)
    finally:
        for path in making.values():
            path.unlink(missing_ok=True)
    return list(paths.values())


def _trials(reader: JournalReader) -> Iterator[str]:
    """Lines of the table, some thousands at a time, without objects in between: there may be millions."""
    if reader.schema_version < FIRST_WITH_CHECKSUMS:
        for generation in reader.generations():
            yield from (_line(_attempt_cells(row)) for row in reader.attempts(generation.number))
        return
    starts = {identity: " ".join(map(repr, values)) for identity, values in reader.starts().items()}
    names = columns_of("attempt")
    for part in reader.all_columns("attempt", "id"):
        columns = dict(zip(names, part, strict=True))
        columns["start"] = [starts[identity] for identity in columns["start"]]
        columns["noise_key"] = np.array(columns["noise_key"], np.int64).view(np.uint64).tolist()
        # lists of numbers have no line breaks: all of them at once
        states = "\n".join(text or "" for text in columns["final_state"])
        columns["final_state"] = states.replace("[", "").replace("]", "").replace(",", " ").split("\n")
        yield _lines([columns[name] for name in names if not name.endswith("_at")])


def _lines(columns: Sequence[Sequence[Any]]) -> str:
    """Rows, at least one, given column by column, as the csv module writes them one by one, which takes longer."""
    form, varying = [], []
    for column in columns:
        kinds, first = set(map(type, column)), column[0]
        if len(kinds) == 1 and column.count(first) == len(column):
            form.append(_field(first).replace("%", "%%"))
            continue
        plain = kinds <= {int, float} or (kinds == {str} and not _NEEDS_QUOTES.search("".join(column)))
        form.append("%s" if kinds == {str} or not plain else "%r")
        varying.append(column if plain else [_field(value) for value in column])
    line = ",".join(form) + "\r\n"
    return "".join([line % row for row in zip(*varying, strict=True)]) if varying else line % () * len(columns[0])


def _line(cells: Iterable[object]) -> str:
    text = io.StringIO()
    csv.writer(text).writerow(cells)
    return text.getvalue()


def _field(value: object) -> str:
    # beside another one: alone, nothing at all would be put into quotation marks
    return _line(["", value])[1:-2]


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

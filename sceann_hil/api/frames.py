"""Rows as pandas frames. pandas is an extra that only this module asks for."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import fields
from enum import Enum
from typing import TYPE_CHECKING, Any

from sceann_hil.errors import PackageMissing

if TYPE_CHECKING:
    import pandas


def pandas_module() -> Any:
    """The package.

    Raises:
        PackageMissing: it is not installed.
    """
    try:
        import pandas
    except ModuleNotFoundError:
        raise PackageMissing(
            "Tables are pandas frames, and pandas is not installed.", "pip install 'sceann-hil[notebook]'"
        ) from None
    return pandas


def frame_of(kind: type, rows: Iterable[Any], index: str | None = None) -> pandas.DataFrame:
    """A table of dataclass rows, one column per field.

    Args:
        kind: the rows' dataclass, for the columns of a table without rows.
        rows: of that kind.
        index: the column that names the rows.
    """
    names = [field.name for field in fields(kind)]
    columns: dict[str, list[Any]] = {name: [] for name in names}
    for row in rows:
        for name in names:
            columns[name].append(_cell(getattr(row, name)))
    frame: pandas.DataFrame = pandas_module().DataFrame(columns)
    for name, values in columns.items():
        if None in values and {type(value) for value in values} == {int, type(None)}:
            frame[name] = frame[name].astype("Int64")  # whole numbers stay whole where some are missing
    return frame.set_index(index) if index is not None else frame


def table(columns: Sequence[str], rows: Iterable[Sequence[Any]], index: str | None = None) -> pandas.DataFrame:
    """A table of plain rows."""
    frame: pandas.DataFrame = pandas_module().DataFrame([list(row) for row in rows], columns=list(columns))
    return frame.set_index(index) if index is not None else frame


def split_tuples(frame: pandas.DataFrame, column: str, names: Sequence[str]) -> pandas.DataFrame:
    """`frame` with a column of its own for every element of the tuples in `column`, named ``column_name``."""
    for place, name in enumerate(names):
        values = [value[place] if isinstance(value, tuple) and place < len(value) else None for value in frame[column]]
        frame[f"{column}_{name}"] = pandas_module().Series(values, index=frame.index, dtype="float64")
    return frame.drop(columns=column)


def _cell(value: Any) -> Any:
    if isinstance(value, Enum):
        return value.name.lower()
    return json.dumps(value) if isinstance(value, dict) else value

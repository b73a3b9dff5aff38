"""A checksum for every row of a database, so that a flipped bit is noticed wherever the row is read.

Each value of a row becomes 64 bits: an integer itself, a real number its IEEE 754 bits, text and bytes their CRC-32 and
length, NULL a constant. The bits are mixed column after column (FNV-1a's step on 64 bits, with a shift that brings high
bits down); the lower 32 bits of the outcome are the checksum. It guards against damage, not against a person.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Column = Sequence[Any] | NDArray[Any] | int | float | str | bytes | None
"""One column of n rows; a single value stands for n equal ones."""

_PRIME = np.uint64(0x100000001B3)
_BASIS = np.uint64(0xCBF29CE484222325)
_SHIFT = np.uint64(29)
_NULL = 0x9E3779B97F4A7C15
_MASK = 2**64 - 1


def row_checksums(columns: Sequence[Column], n: int) -> list[int]:
    """The checksum of each of n rows, 0 <= checksum < 2**32.

    Args:
        columns: in the order of `sceann_hil.journal.schema.COLUMNS`.
        n: number of rows.
    """
    mixed = np.full(n, _BASIS, np.uint64)
    with np.errstate(over="ignore"):
        for column in columns:
            mixed ^= _bits_of_column(column)
            mixed *= _PRIME
            mixed ^= mixed >> _SHIFT
        mixed *= _PRIME
        mixed ^= mixed >> np.uint64(32)
    checksums: list[int] = (mixed & np.uint64(0xFFFFFFFF)).astype(np.int64).tolist()
    return checksums


def first_wrong(rows: Sequence[tuple[Any, ...]]) -> tuple[Any, ...] | None:
    """The first row that its last column is not the checksum of; None if there is none."""
    if len(rows) < 8:
        return next((row for row in rows if row_checksum(row[:-1]) != row[-1]), None)
    wrong = first_wrong_place([*zip(*rows, strict=True)])
    return None if wrong is None else rows[wrong]


def first_wrong_place(columns: Sequence[Column]) -> int | None:
    """The first row that the last column is not the checksum of, of rows that are given column by column."""
    *values, stored = columns
    now = row_checksums(values, len(stored))  # type: ignore[arg-type]
    if tuple(now) == tuple(stored):  # type: ignore[arg-type]
        return None
    return next(place for place, (known, made) in enumerate(zip(stored, now, strict=True)) if known != made)  # type: ignore[arg-type]


def row_checksum(row: Sequence[Any]) -> int:
    """The checksum of one row."""
    mixed = int(_BASIS)
    for value in row:
        mixed = ((mixed ^ _bits(value)) * int(_PRIME)) & _MASK
        mixed ^= mixed >> int(_SHIFT)
    mixed = (mixed * int(_PRIME)) & _MASK
    return (mixed ^ (mixed >> 32)) & 0xFFFFFFFF


def _bits(value: object) -> int:
    if value is None or value != value:
        return _NULL
    if isinstance(value, int):
        return value & _MASK
    if isinstance(value, float):
        # SQLite keeps no sign of zero
        return int(struct.unpack("<Q", struct.pack("<d", value + 0.0))[0])
    data = value.encode("utf-8", "surrogatepass") if isinstance(value, str) else bytes(value)  # type: ignore[call-overload]
    return zlib.crc32(data) | len(data) << 32


def _bits_of_column(column: Column) -> NDArray[np.uint64] | np.uint64:
    if isinstance(column, np.ndarray):
        if column.dtype.kind == "f":
            return _of_reals(column)
        return column.astype(np.int64, copy=False).view(np.uint64)
    if column is None or isinstance(column, int | float | str | bytes):
        return np.uint64(_bits(column))
    return _bits_of_values(column)


def _bits_of_values(column: Sequence[Any]) -> NDArray[np.uint64] | np.uint64:
    if column and column[0] == column[-1] and column.count(column[0]) == len(column):
        return np.uint64(_bits(column[0]))
    kinds = set(map(type, column))
    if kinds <= {type(None)}:
        return np.uint64(_NULL)
    if kinds == {int}:
        return np.array(column, np.int64).view(np.uint64)
    if kinds <= {float, type(None)}:
        return _of_reals(np.array(column, np.float64))
    if kinds == {str}:
        texts = _encoded(column)
        lengths = np.array([*map(len, texts)], np.uint64)
        return np.array([*map(zlib.crc32, texts)], np.uint64) | lengths << np.uint64(32)
    return np.array([_bits(value) for value in column], np.uint64)


def _encoded(texts: Sequence[str]) -> list[bytes]:
    """In UTF-8: all at once, unless the separator is in one of them."""
    together = "\n".join(texts).encode("utf-8", "surrogatepass").split(b"\n")
    if len(together) == len(texts):
        return together
    return [text.encode("utf-8", "surrogatepass") for text in texts]


def _of_reals(values: NDArray[Any]) -> NDArray[np.uint64]:
    values = values.astype(np.float64) + 0.0
    return np.where(np.isnan(values), np.uint64(_NULL), values.view(np.uint64))

"""Rows with their checksums, and generations with their digests, into a journal."""

from __future__ import annotations

import sqlite3
import time
import zlib
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.journal.checksums import Column, row_checksum, row_checksums
from sceann_hil.journal.digests import begun_digest, digest_before, finished_digest
from sceann_hil.journal.schema import columns_of
from sceann_hil.network.coding import Bits, genomes_to_hex


def insert_row(
    db: sqlite3.Connection,
    table: str,
    row: Sequence[Any],
    *,
    replace: bool = False,
    columns_of: Callable[[str], list[str]] = columns_of,
) -> None:
    """One row; with `replace` also in the place of the one with the same key."""
    key, *others = columns = [*columns_of(table), "checksum"]
    # to delete the old row, as REPLACE does, SQLite reads every row of the tables that may refer to it
    new = f" ON CONFLICT ({key}) DO UPDATE SET {', '.join(f'{name} = excluded.{name}' for name in others)}"
    db.execute(
        f"INSERT INTO {table} ({', '.join(columns)}) VALUES ({', '.join('?' * len(columns))}){new if replace else ''}",
        (*row, row_checksum(row)),
    )


def insert_columns(
    db: sqlite3.Connection,
    table: str,
    names: Sequence[str],
    columns: Sequence[Column],
    checksums: Sequence[int],
    n: int,
) -> None:
    """n rows, given column by column; what is the same whole number in all of them, or a word, is told once."""
    values, varying = [], []
    for column in columns:
        if column is None or isinstance(column, int) or (isinstance(column, str) and column.isidentifier()):
            values.append("NULL" if column is None else f"'{column}'" if isinstance(column, str) else str(column))
        else:
            values.append("?")
            varying.append(listed(column, n))
    db.executemany(
        f"INSERT INTO {table} ({', '.join(names)}, checksum) VALUES ({', '.join(values)}, ?)",
        zip(*varying, checksums, strict=True),
    )


def update_columns(
    db: sqlite3.Connection,
    table: str,
    names: Sequence[str],
    columns: Sequence[Column],
    checksums: Sequence[int],
    ids: Sequence[int],
) -> None:
    """Some columns of the rows with these ids; what nobody knows is NULL already."""
    told = [(name, column) for name, column in zip(names, columns, strict=True) if column is not None]
    db.executemany(
        f"UPDATE {table} SET {', '.join(f'{name} = ?' for name, _ in told)}, checksum = ? WHERE id = ?",
        zip(*(listed(column, len(ids)) for _, column in told), checksums, ids, strict=True),
    )


def insert_generation(
    db: sqlite3.Connection,
    number: int,
    state: bytes,
    genomes: Bits,
    parents: Sequence[int | None] | None,
    ancestors: Sequence[int | None] | None,
    structures: Sequence[str | None],
) -> None:
    """A generation as it begins; parents are ids in this run, ancestors in the run that this one goes on from."""
    n = len(genomes)
    db.execute(
        "INSERT INTO generation (number, algorithm_state, started_at, state_checksum) VALUES (?, ?, ?, ?)",
        (number, state, now_text(), zlib.crc32(state)),
    )
    first = 1 + int(db.execute("SELECT coalesce(max(id), 0) FROM individual").fetchone()[0])
    ids, numbers = np.arange(first, first + n), np.arange(n)
    hexes = genomes_to_hex(genomes)
    columns: list[Column] = [ids, number, numbers, hexes, parents, ancestors, structures, None]
    insert_columns(db, "individual", columns_of("individual"), columns, row_checksums(columns, n), n)
    rewrite_digests(db, since_generation=number)


def update_checksums(db: sqlite3.Connection, table: str, where: str = "", *values: Any) -> None:
    """Compute the checksums of some rows again, after a change."""
    columns = columns_of(table)
    rows = db.execute(f"SELECT {', '.join(columns)} FROM {table} {where}", values).fetchall()
    if rows:
        checksums = row_checksums(list(zip(*rows, strict=True)), len(rows))
        key = columns[0]
        db.executemany(
            f"UPDATE {table} SET checksum = ? WHERE {key} = ?",
            [(checksum, row[0]) for checksum, row in zip(checksums, rows, strict=True)],
        )


def rewrite_digests(
    db: sqlite3.Connection, *, since_generation: int | None = None, since_attempt: int | None = None
) -> None:
    """Chain the generations again from one on, or from the one on that an attempt belongs to."""
    if since_generation is None:
        since_generation = db.execute(
            "SELECT coalesce(min(number), 9e18) FROM generation WHERE last_attempt >= ?", (since_attempt,)
        ).fetchone()[0]
    rows = db.execute(
        "SELECT number, finished_at FROM generation WHERE number >= ? ORDER BY number", (since_generation,)
    ).fetchall()
    for number, finished_at in rows:
        begun = begun_digest(db, number, digest_before(db, number))
        digest = None if finished_at is None else finished_digest(db, number, begun)
        db.execute("UPDATE generation SET begun_digest = ?, digest = ? WHERE number = ?", (begun, digest, number))
        update_checksums(db, "generation", "WHERE number = ?", number)


def write_finished_digest(db: sqlite3.Connection, number: int) -> None:
    """Of a generation that has just been finished and is the newest: it began with what its digest says."""
    begun = db.execute("SELECT begun_digest FROM generation WHERE number = ?", (number,)).fetchone()[0]
    digest = finished_digest(db, number, begun)
    db.execute("UPDATE generation SET digest = ? WHERE number = ?", (digest, number))
    update_checksums(db, "generation", "WHERE number = ?", number)


def now_text() -> str:
    """UTC, ISO 8601, to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def milliseconds() -> int:
    """Since 1970, UTC."""
    return time.time_ns() // 1_000_000


def readable(text: str) -> str:
    """Text as SQLite can keep it: half a surrogate pair, which no encoding has, becomes a question mark."""
    return text.encode("utf-8", "replace").decode("utf-8")


def listed(column: Column, n: int) -> Sequence[Any]:
    """A column as Python values, for SQLite."""
    if isinstance(column, np.ndarray):
        return column.tolist()  # type: ignore[no-any-return]
    if column is None or isinstance(column, int | float | str | bytes):
        return [column] * n
    return column


def unless(is_void: NDArray[np.bool_] | None, values: NDArray[np.float64] | None) -> Column:
    """Values, and None where an attempt measured nothing."""
    if values is None or is_void is None:
        return values
    return [None if nothing else value for nothing, value in zip(is_void.tolist(), values.tolist(), strict=True)]

"""Rows of a journal as they stand, each compared with its checksum."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from sceann_hil.errors import RunIsDamaged, way_out_of_damage
from sceann_hil.journal.checksums import first_wrong, first_wrong_place
from sceann_hil.journal.database import understood
from sceann_hil.journal.rows import place_of
from sceann_hil.journal.schema import FIRST_WITH_CHECKSUMS, columns_of

_ROWS_AT_ONCE = 20_000


class CheckedRows:
    """Questions to the tables themselves; `sceann_hil.journal.JournalReader` says how one is opened."""

    path: Path
    _db: sqlite3.Connection
    _checked: bool
    _schema: int

    @property
    def database(self) -> sqlite3.Connection:
        """The connection, for questions that no method asks."""
        return self._db

    def rows(self, table: str, where: str = "", *values: Any) -> list[tuple[Any, ...]]:
        """Rows of a table, `columns_of` it."""
        rows = self._rows(table, where, *values)
        if self._compares:
            with understood(self.path):
                wrong = first_wrong(rows) if rows else None
            self._refuse(table, wrong)
        return [row[:-1] for row in rows]

    def all_rows(self, table: str, key: str) -> Iterator[list[tuple[Any, ...]]]:
        """All rows of a table in the order of its key, some thousands at a time."""
        for columns in self.all_columns(table, key):
            yield [*zip(*columns, strict=True)]

    def all_columns(self, table: str, key: str) -> Iterator[list[Sequence[Any]]]:
        """The same, column by column: `columns_of` the table."""
        last = -1
        while rows := self._rows(table, f"WHERE {key} > ? ORDER BY {key} LIMIT {_ROWS_AT_ONCE}", last):
            columns: list[Sequence[Any]] = [*zip(*rows, strict=True)]
            if self._compares:
                with understood(self.path):
                    wrong = first_wrong_place(columns)
                self._refuse(table, None if wrong is None else rows[wrong])
            yield columns[:-1]
            last = columns[0][-1]

    def one(self, question: str, *values: Any) -> tuple[Any, ...]:
        """The answer to a question that has one row."""
        with understood(self.path):
            row = self._db.execute(question, values).fetchone()
        if row is None:
            raise self.damaged("a row is missing")
        return tuple(row)

    def damaged(self, what: str) -> RunIsDamaged:
        """An error that says where."""
        return RunIsDamaged(f"{self.path} is damaged: {what}.", way_out_of_damage(self.path))

    def _rows(self, table: str, where: str, *values: Any) -> list[tuple[Any, ...]]:
        with understood(self.path):
            question = f"SELECT {', '.join(columns_of(table))}, checksum FROM {table} {where}"
            return self._db.execute(question, values).fetchall()

    @property
    def _compares(self) -> bool:
        return self._checked and self._schema >= FIRST_WITH_CHECKSUMS

    def _refuse(self, table: str, wrong: tuple[Any, ...] | None) -> None:
        if wrong is not None:
            raise self.damaged(f"{place_of(table, wrong)} is not as it was written")

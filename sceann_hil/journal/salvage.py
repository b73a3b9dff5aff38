"""The way out of damage: a new journal of everything that is sound up to a generation; the damaged file is kept."""

from __future__ import annotations

import os
import sqlite3
from contextlib import suppress
from pathlib import Path

from sceann_hil.errors import NotARun, RunIsDamaged
from sceann_hil.journal.database import understood
from sceann_hil.journal.insertion import insert_row, now_text, rewrite_digests
from sceann_hil.journal.making import is_unborn, new_journal
from sceann_hil.journal.reader import JournalReader, journal_path
from sceann_hil.journal.schema import UNBORN_NAME, columns_of
from sceann_hil.journal.seal import seal_path
from sceann_hil.journal.verify import examine


def return_to_generation(directory: Path, number: int) -> Path:
    """Make a run's journal end with a finished generation; the caller holds the `RunLock`.

    What comes after it is not in the new journal. The old one is kept beside it, whole.

    Args:
        directory: the run.
        number: of the generation.

    Returns:
        Where the old journal is now.

    Raises:
        RunIsDamaged: the generation, or one before it, is damaged.
        NotARun: there is no such generation.
    """
    path = journal_path(directory)
    verdict = examine(directory)
    if not verdict.has_checksums:
        raise NotARun(
            f"{path} is of schema 1: nobody can tell which of its generations are sound.", "Restore a backup."
        )
    if verdict.damage and (verdict.last_sound is None or number > verdict.last_sound):
        raise RunIsDamaged(verdict.damage[0], verdict.way_out.replace(" DIR ", f" {directory} "))
    if verdict.last_sound is None or not 0 <= number <= verdict.last_sound:
        raise NotARun(
            f"{directory} has no finished generation {number}.",
            f"Finished are 0 to {verdict.last_sound}." if verdict.last_sound is not None else "None is finished.",
        )
    for leftover in filter(is_unborn, directory.iterdir()):
        leftover.unlink()
    making = directory / UNBORN_NAME
    reader = JournalReader(directory, checked=False)
    try:
        _copy(reader, making, number)
    finally:
        reader.close()
    kept = _keep(path)
    making.replace(path)
    return kept


def _copy(reader: JournalReader, making: Path, number: int) -> None:
    with understood(making), new_journal(making) as db:
        last = reader.one("SELECT last_attempt FROM generation WHERE number = ?", number)[0]
        _copy_rows(reader, db, number, last)
        event = 1 + db.execute("SELECT coalesce(max(id), 0) FROM event").fetchone()[0]
        words = f"went back to generation {number}; the journal of before is kept beside this one"
        insert_row(db, "event", (event, now_text(), number, "damage", words))


def _copy_rows(reader: JournalReader, db: sqlite3.Connection, number: int, last: int) -> None:
    """Sound rows only: of each table those of the generations that are kept, and those that belong to none."""
    sound = JournalReader(reader.directory, reader.database)  # compares every row that it reads
    for table in ("run", "robot", "start"):
        for row in sound.rows(table):
            insert_row(db, table, row)
    for table in ("session", "measurement", "event"):
        _insert_sound_ones(
            sound, db, table, "id", reader.database.execute(f"SELECT id FROM {table} ORDER BY id").fetchall()
        )
    names = columns_of("generation")
    for generation in range(number + 1):
        state = sound.algorithm_state(generation)
        (row,) = sound.rows("generation", "WHERE number = ?", generation)
        db.execute(
            f"INSERT INTO generation ({', '.join(names)}, algorithm_state) VALUES ({'?, ' * len(names)}?)",
            (*row, state),
        )
        for row in sound.rows("individual", "WHERE generation = ? ORDER BY number", generation):
            insert_row(db, "individual", row)
    after = 0
    while rows := sound.rows("attempt", "WHERE id > ? AND id <= ? ORDER BY id LIMIT 20000", after, last):
        for row in rows:
            insert_row(db, "attempt", row)
        traced = reader.database.execute(
            "SELECT attempt FROM trace WHERE attempt > ? AND attempt <= ?", (after, rows[-1][0])
        ).fetchall()
        _insert_sound_ones(sound, db, "trace", "attempt", traced)
        after = rows[-1][0]
    others = reader.database.execute(
        "SELECT id FROM attempt WHERE id > ? AND kind <> 'evolution' ORDER BY id", (last,)
    ).fetchall()
    _insert_sound_ones(sound, db, "attempt", "id", others)
    _insert_sound_ones(sound, db, "trace", "attempt", others)
    rewrite_digests(db, since_generation=0)


def _insert_sound_ones(
    sound: JournalReader, db: sqlite3.Connection, table: str, key: str, keys: list[tuple[int]]
) -> None:
    for (value,) in keys:
        with suppress(RunIsDamaged):
            for row in sound.rows(table, f"WHERE {key} = ?", value):
                insert_row(db, table, row)


def _keep(path: Path) -> Path:
    """Give the damaged database, with its log and seal, a second name, and take the log away from the first."""
    number = 1
    while (kept := path.with_name(f"damaged-{number}-{path.name}")).exists():
        number += 1
    os.link(path, kept)
    for end in ("-wal", "-shm"):
        beside = path.with_name(path.name + end)
        if beside.exists():
            beside.rename(kept.with_name(kept.name + end))
    if seal_path(path).exists():
        seal_path(path).rename(seal_path(kept))
    return kept

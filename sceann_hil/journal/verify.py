"""Is a journal as it was written? Every row, every link between rows, and SQLite's own structures are looked at."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sceann_hil.errors import RunIsDamaged, UserError
from sceann_hil.journal.database import understood
from sceann_hil.journal.digests import begun_digest, digest_before, finished_digest
from sceann_hil.journal.intents import unpack_slots
from sceann_hil.journal.reader import JournalReader, journal_path
from sceann_hil.journal.schema import FIRST_WITH_CHECKSUMS
from sceann_hil.journal.seal import is_untouched

_MOST_COMPLAINTS_OF_SQLITE = 20
ALL_OF = 100_000
"""Attempts in a journal up to which every command that writes looks at all of it, in a second or two."""


@dataclass(frozen=True, slots=True)
class Verdict:
    """What was found.

    Attributes:
        damage: in words, with the place; empty if everything is as it was written.
        generations: that are finished, as far as that can be read.
        last_sound: number of the last finished generation that is sound with all before it; None if there is none.
        untouched: the file is the same, byte for byte, as its last process left it.
        has_checksums: False for journals of schema 1, of which only SQLite's structures can be looked at.
    """

    damage: tuple[str, ...]
    generations: int = 0
    last_sound: int | None = None
    untouched: bool = False
    has_checksums: bool = True

    @property
    def way_out(self) -> str:
        """What can be done about the damage."""
        if self.last_sound is None:
            return "No generation is sound: restore a backup. `sqlite3 FILE .recover` may save parts."
        return (
            f"Generation {self.last_sound} is the last sound one: `sceann resume DIR --from-generation "
            f"{self.last_sound}` goes on from it and keeps the damaged file."
        )


def examine(directory: Path, newest: int | None = None) -> Verdict:
    """Look at everything in a run's journal.

    Args:
        directory: the run.
        newest: where there are more attempts than this, look at the newest generations that have so many, and of
            those before only at their figures.

    Raises:
        NotARun, RunIsNewer, CannotRead: there is nothing to look at.
    """
    path = journal_path(directory)
    untouched = is_untouched(path)
    damage: list[str] = []
    try:
        reader = JournalReader(directory)
    except RunIsDamaged as error:
        damage.append(error.message)
        try:
            reader = JournalReader(directory, checked=False)
        except RunIsDamaged:
            return Verdict(tuple(damage))
        reader = JournalReader(directory, reader.database)  # rows are compared all the same
    try:
        since = 0 if newest is None else _first_of_newest(reader, newest)
        if not since:
            damage += complaints_of_sqlite(reader.database, reader.path)
        if reader.schema_version < FIRST_WITH_CHECKSUMS:
            finished = len(reader.generations(finished=True)) if not damage else 0
            return Verdict(tuple(damage), finished, has_checksums=False)
        fundamental = [*_tried(lambda: _read(reader, "run", "robot", "start"))]
        damage += fundamental
        damage += _tried(lambda: _read(reader, "session", "measurement", "event"))
        damage += _tried(lambda: _batches(reader))
        finished, last_sound = 0, None
        sound = not fundamental
        for number, complaints, is_finished in _generations(reader, since):
            damage += complaints
            sound = sound and not complaints
            finished += is_finished
            if sound and is_finished:
                last_sound = number
        damage += _tried(lambda: _rest(reader))
        return Verdict(tuple(dict.fromkeys(damage)), finished, last_sound, untouched and not damage)
    finally:
        reader.close()


def require_sound(directory: Path) -> None:
    """Refuse a journal in which something is damaged; quick if it is byte for byte as its last process left it.

    After a crash a long run would keep people waiting: then only its newest `ALL_OF` attempts are looked at, and what
    evolution goes on from. Every row is compared with its checksum when it is read in any case.

    Raises:
        RunIsDamaged: with the place, and the last generation that is sound.
    """
    if is_untouched(journal_path(directory)):
        return
    verdict = examine(directory, ALL_OF)
    if verdict.damage:
        more = f" ({len(verdict.damage) - 1} more: `sceann check {directory}`)" if len(verdict.damage) > 1 else ""
        raise RunIsDamaged(
            f"{verdict.damage[0].rstrip('.')}{more}.", verdict.way_out.replace(" DIR ", f" {directory} ")
        )


def complaints_of_sqlite(db: sqlite3.Connection, path: Path, what: str = "journal") -> Iterator[str]:
    """What SQLite's own checks say, one line each."""
    for question, meaning in (
        (f"PRAGMA main.integrity_check({_MOST_COMPLAINTS_OF_SQLITE})", "SQLite's check"),
        ("PRAGMA main.foreign_key_check", "a row refers to one that is missing"),
    ):
        try:
            with understood(path, what):
                for row in db.execute(question).fetchall():
                    if row[0] != "ok":
                        yield f"{path} is damaged: {meaning}: {', '.join(map(str, row))}"
        except RunIsDamaged as error:
            yield error.message


def _tried(look: Callable[[], None]) -> Iterator[str]:
    try:
        look()
    except RunIsDamaged as error:
        yield error.message


def _read(reader: JournalReader, *tables: str) -> None:
    for table in tables:
        reader.rows(table)
    if "run" in tables:
        reader.run()


def _first_of_newest(reader: JournalReader, attempts: int) -> int:
    """The first of the newest generations that have so many attempts; 0 if all together have no more."""
    try:
        before = reader.count_attempts() - attempts
        question = "SELECT count(*) FROM generation WHERE last_attempt <= ?"
        return int(reader.one(question, before)[0]) if before > 0 else 0
    except RunIsDamaged:
        return 0


def _generations(reader: JournalReader, since: int) -> Iterator[tuple[int, list[str], bool]]:
    """Number, complaints, and whether it is finished, of every generation; of those before `since` the figures only."""
    try:
        with understood(reader.path):
            question = "SELECT number, finished_at, last_attempt FROM generation ORDER BY number"
            rows = reader.database.execute(question).fetchall()
            averaged = _fitness_is_a_mean(reader)
    except UserError as error:
        yield 0, [error.message], False
        return
    last, after = -1, 0
    for number, finished_at, last_attempt in rows:
        complaints: list[str] = []
        if number != last + 1:
            complaints.append(f"{reader.path} is damaged: generation {last + 1} is missing")
        till = last_attempt if last_attempt is not None else 2**62
        if number < since:
            complaints += _tried(lambda n=number: _figures(reader, n))  # type: ignore[misc]
        else:
            complaints += _tried(
                lambda n=number, a=after, t=till, f=finished_at: _generation(reader, n, a, t, f, averaged)  # type: ignore[misc]
            )
        yield number, complaints, finished_at is not None
        last, after = number, till


def _figures(reader: JournalReader, number: int) -> None:
    reader.generation(number)


def _generation(
    reader: JournalReader, number: int, after: int, till: int, finished_at: str | None, averaged: bool
) -> None:
    reader.generation(number)
    reader.algorithm_state(number)
    individuals = reader.individuals(number)
    attempts = reader.rows("attempt", "WHERE id > ? AND id <= ? ORDER BY id", after, till)
    for row in reader.rows("trace", "WHERE attempt > ? AND attempt <= ?", after, till):
        reader.sensor_trace(row[0])
    _understand(reader, attempts)
    with understood(reader.path):
        known, digest = reader.database.execute(
            "SELECT begun_digest, digest FROM generation WHERE number = ?", (number,)
        ).fetchone()
        begun = begun_digest(reader.database, number, digest_before(reader.database, number))
        if begun != known or (finished_at is not None and finished_digest(reader.database, number, begun) != digest):
            raise reader.damaged(f"rows of generation {number} are missing, too many, or of another run")
    if finished_at is not None and averaged:
        _compare_fitness(reader, number, individuals, attempts)


def _understand(reader: JournalReader, attempts: list[tuple[Any, ...]]) -> None:
    from sceann_hil.journal.attempts import attempt_rows

    with understood(reader.path):
        attempt_rows(attempts, reader.starts())


def _compare_fitness(reader: JournalReader, number: int, individuals: list[Any], attempts: list[Any]) -> None:
    counted = [(row[5], row[6], row[19]) for row in attempts if row[4] == number and row[19] is not None]
    if not counted:
        return
    fitness = np.full((len(individuals), 1 + max(trial for _, trial, _ in counted)), np.nan)
    places = np.array([(individual, trial) for individual, trial, _ in counted])
    if places[:, 0].max() >= len(individuals):
        raise reader.damaged(f"a trial of generation {number} belongs to no individual")
    fitness[places[:, 0], places[:, 1]] = [value for _, _, value in counted]
    # an algorithm may want some of the task's trials only
    fitness = fitness[:, ~np.isnan(fitness).all(axis=0)]
    known = np.array([row.fitness for row in individuals], np.float64)
    wrong = ~np.isclose(fitness.mean(axis=1), known, rtol=1e-9, atol=1e-12)
    if wrong.any():
        identity = individuals[int(wrong.argmax())].id
        raise reader.damaged(f"individual {identity} of generation {number} has another fitness than its trials")


def _fitness_is_a_mean(reader: JournalReader) -> bool:
    """False where trials were saved, so that an individual's fitness is not the mean of its own."""
    try:
        config = yaml.safe_load(reader.run().config)
    except (yaml.YAMLError, UserError):
        return False
    saving = config.get("saving") if isinstance(config, dict) else None
    saving = saving if isinstance(saving, dict) else {}
    return all(saving.get(way) in (False, None, "off") for way in ("reuse", "pool", "racing"))


def _batches(reader: JournalReader) -> None:
    """Intents whose outcome is not known: of a batch that runs now, or that a process was cut off in."""
    with understood(reader.path):
        for first, n, *_, slots in reader.rows("batch", "ORDER BY first"):
            unpack_slots(slots, n)
            if reader.one("SELECT count(*) FROM attempt WHERE id BETWEEN ? AND ?", first, first + n - 1)[0]:
                raise reader.damaged(f"batch {first} has attempts already")


def _rest(reader: JournalReader) -> None:
    """Attempts after the last generation that is finished, and those that belong to no generation."""
    after = reader.one("SELECT coalesce(max(last_attempt), 0) FROM generation")[0]
    _understand(reader, reader.rows("attempt", "WHERE id > ? ORDER BY id", after))

"""Reading a journal, also while another process writes it. Every row is compared with its checksum when it is read."""

from __future__ import annotations

import json
import sqlite3
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import NotARun, RunIsDamaged, way_out_of_damage
from sceann_hil.journal import schema1, schema2
from sceann_hil.journal.attempts import attempt_row, attempt_rows
from sceann_hil.journal.checked import CheckedRows
from sceann_hil.journal.database import DatabaseKind, open_database, understood
from sceann_hil.journal.entries import AttemptKind
from sceann_hil.journal.rows import (
    AttemptRow,
    GenerationRow,
    IndividualRow,
    MeasurementRow,
    RunRow,
    SessionRow,
    SpentRow,
    generation_row,
    session_row,
)
from sceann_hil.journal.schema import (
    APPLICATION_ID,
    FIRST_WITH_CHECKSUMS,
    JOURNAL_NAME,
    SCHEMA_VERSION,
    UNBORN_NAME,
    columns_of,
)
from sceann_hil.journal.sensor_traces import unpack_sensor_trace
from sceann_hil.places import lacking

KIND = DatabaseKind(
    "journal", APPLICATION_ID, SCHEMA_VERSION, ("run", "generation", "individual", "attempt", "session", "event"),
    "sceann evolve",
)  # fmt: skip


def journal_path(directory: Path) -> Path:
    """The journal in a run's folder.

    Raises:
        NotARun: no folder, or no journal in it.
    """
    path = directory / JOURNAL_NAME
    if path.is_file():
        return path
    if directory.is_dir() and any(directory.glob(f"{UNBORN_NAME}*")):
        raise NotARun(
            f"{directory} is not a run: its process ended before the run began.",
            "Start it again with `sceann evolve`, with the same --out.",
        )
    raise NotARun(
        f"{directory} is not a run: it {lacking(directory, 'has no journal')}.",
        "Name the folder that `sceann evolve` printed (its --out).",
    )


class JournalReader(CheckedRows):
    """Questions to a run's journal.

    Raises (every method, too):
        RunIsDamaged: a row is not as it was written, or SQLite cannot read it.
    """

    def __init__(self, directory: Path, database: sqlite3.Connection | None = None, *, checked: bool = True) -> None:
        """Open the journal in `directory` for reading, or use a connection that is open already.

        Args:
            directory: the run.
            database: open already, of the newest schema.
            checked: notice damage. Without, whatever can be read is told.

        Raises:
            NotARun, RunIsNewer, RunIsDamaged, CannotRead: why not.
        """
        self.directory = directory
        self.path = directory / JOURNAL_NAME
        self._checked = checked
        self._schema = SCHEMA_VERSION
        if database is not None:
            self._db = database
            return
        self.path = journal_path(directory)
        self._db, self._schema = open_database(KIND, self.path, write=False, checked=checked)
        if self._schema < SCHEMA_VERSION:
            with understood(self.path):
                schema2.read_as_today(self._db)
                if self._schema < FIRST_WITH_CHECKSUMS:
                    schema1.read_as_today(self._db)

    @property
    def schema_version(self) -> int:
        """Of the file."""
        return self._schema

    def close(self) -> None:
        """Let go of the file. May be called twice."""
        self._db.close()

    def run(self) -> RunRow:
        """The run itself."""
        rows = self.rows("run")
        if not rows:
            raise RunIsDamaged(f"{self.path} is damaged: its run is missing.", way_out_of_damage(self.path))
        _, name, created_at, root_seed, config, versions, parent = rows[0]
        with understood(self.path):
            return RunRow(name, created_at, root_seed, config, json.loads(versions), parent)

    # -- generations and individuals ----------------------------------------------------------------------------------

    def generations(self, *, finished: bool = False) -> list[GenerationRow]:
        """All generations in order, or only those that are finished."""
        where = "WHERE finished_at IS NOT NULL" if finished else ""
        return [generation_row(row) for row in self.rows("generation", f"{where} ORDER BY number")]

    def generation(self, number: int) -> GenerationRow | None:
        """One generation; None if there is none of this number."""
        rows = self.rows("generation", "WHERE number = ?", number)
        return generation_row(rows[0]) if rows else None

    def last_generation(self) -> GenerationRow | None:
        """The newest generation, finished or not; None in a run that has not begun."""
        rows = self.rows("generation", "ORDER BY number DESC LIMIT 1")
        return generation_row(rows[0]) if rows else None

    def algorithm_state(self, generation: int) -> bytes:
        """The algorithm's state that a generation began with."""
        row = self.one("SELECT algorithm_state, state_checksum FROM generation WHERE number = ?", generation)
        state, checksum = bytes(row[0]), row[1]
        if self._checked and checksum is not None and zlib.crc32(state) != checksum:
            raise self.damaged(f"the algorithm's state of generation {generation} is not as it was written")
        return state

    def individuals(self, generation: int) -> list[IndividualRow]:
        """A generation's individuals in order."""
        return [
            IndividualRow(*row) for row in self.rows("individual", "WHERE generation = ? ORDER BY number", generation)
        ]

    def fitness(self, generation: int) -> NDArray[np.float64]:
        """Fitness of a finished generation's individuals in order, shape ``(population,)``."""
        return np.array([row.fitness for row in self.individuals(generation)], np.float64)

    def individual(self, identity: int) -> IndividualRow:
        """One individual by its id.

        Raises:
            NotARun: the run has no such individual.
        """
        rows = self.rows("individual", "WHERE id = ?", _within_64_bits(identity))
        if not rows:
            last = self.one("SELECT coalesce(max(id), 0) FROM individual")[0]
            raise NotARun(
                f"{self.directory} has no individual {identity}.", f"Individuals are numbered from 1 to {last}."
            )
        return IndividualRow(*rows[0])

    def champion(self) -> IndividualRow | None:
        """The best individual of the last finished generation; the first of equals. None before there is one.

        Where the newest individual's structure says which genome is `recommended`, it is the newest individual with
        that genome whose trials are counted: an algorithm may know better than its last generation's fitness.
        """
        for row in self.rows("individual", "ORDER BY generation DESC, number LIMIT 1"):
            structure = IndividualRow(*row).structure
            told = json.loads(structure) if structure else None
            if isinstance(told, dict) and "recommended" in told:
                same = "WHERE genome = ? AND fitness IS NOT NULL ORDER BY generation DESC LIMIT 1"
                for recommended in self.rows("individual", same, told["recommended"]):
                    return IndividualRow(*recommended)
        return self._best_of("SELECT max(number) FROM generation WHERE finished_at IS NOT NULL")

    def best_ever(self) -> IndividualRow | None:
        """The best individual of all finished generations; the first of equals. None before there is one."""
        best = "WHERE finished_at IS NOT NULL ORDER BY best_fitness DESC, number LIMIT 1"
        return self._best_of(f"SELECT (SELECT number FROM generation {best})")

    def _best_of(self, generation: str) -> IndividualRow | None:
        number = self.one(generation)[0]
        if number is None:
            return None
        rows = self.rows("individual", "WHERE generation = ? ORDER BY fitness DESC, number LIMIT 1", number)
        if not rows:
            raise self.damaged(f"generation {number} has no individuals")
        return IndividualRow(*rows[0])

    # -- attempts -----------------------------------------------------------------------------------------------------

    def attempts(self, generation: int) -> list[AttemptRow]:
        """A generation's attempts in the order of their ids."""
        if self._schema < FIRST_WITH_CHECKSUMS:
            return self._attempts("WHERE generation = ? ORDER BY id", generation)
        before = self.one("SELECT max(last_attempt) FROM generation WHERE number = ?", generation - 1)[0]
        last = self.one("SELECT max(last_attempt) FROM generation WHERE number = ?", generation)[0]
        return self._attempts(
            "WHERE id > ? AND id <= ? AND generation = ? ORDER BY id", before or 0, last or 2**62, generation
        )

    def count_counted(self, generation: int) -> int:
        """How many of a generation's attempts have a fitness, without a look at their rows."""
        question = "SELECT count(*) FROM attempt WHERE generation = ? AND fitness IS NOT NULL"
        return int(self.one(question, generation)[0])

    def attempt(self, identity: int) -> AttemptRow:
        """One attempt by its id.

        Raises:
            NotARun: the run has no such trial.
        """
        found = self._attempts("WHERE id = ?", _within_64_bits(identity))
        if found:
            return found[0]
        last = self.count_attempts()
        known = f"Trials are numbered from 1 to {last}." if last else "It has no trials yet."
        raise NotARun(f"{self.directory} has no trial {identity}.", known)

    def attempts_of_kind(self, kind: AttemptKind) -> list[AttemptRow]:
        """All attempts of a kind other than evolution in the order of their ids."""
        return self._attempts("WHERE kind = ? AND kind <> 'evolution' ORDER BY id", kind.value)

    def attempts_of_measurement(self, measurement: int) -> list[AttemptRow]:
        """A measurement's attempts in the order of their ids."""
        return self._attempts(
            "WHERE kind = 'measurement' AND kind <> 'evolution' AND measurement = ? ORDER BY id", measurement
        )

    def attempts_of_genome(self, genome: str, before_generation: int) -> list[AttemptRow]:
        """Counted attempts of a genome (hexadecimal) in generations before one, in the order of their ids."""
        return self._attempts(
            "WHERE fitness IS NOT NULL AND (generation, individual) IN (SELECT generation, number FROM individual "
            "WHERE genome = ? AND generation < ?) ORDER BY id",
            genome,
            before_generation,
        )

    def all_attempts(self) -> Iterator[list[AttemptRow]]:
        """All attempts of all kinds in the order of their ids, some thousands at a time."""
        for rows in self.all_rows("attempt", "id"):
            with understood(self.path):
                yield attempt_rows(rows, self._starts_of(rows))

    def attempts_since_reference(self) -> int:
        """Attempts of evolution that ended since the newest run of the reference genome, in all sessions."""
        newest = self.one("SELECT coalesce(max(id), 0) FROM attempt WHERE kind = 'reference' AND kind <> 'evolution'")[
            0
        ]
        return int(self.one("SELECT count(end_reason) FROM attempt WHERE id > ? AND kind = 'evolution'", newest)[0])

    def count_attempts(self) -> int:
        """The highest attempt id so far."""
        return int(
            self.one(
                "SELECT max((SELECT coalesce(max(id), 0) FROM attempt), "
                "(SELECT coalesce(max(first + attempts - 1), 0) FROM batch))"
            )[0]
        )

    def sensor_trace(self, attempt: int) -> tuple[NDArray[np.uint16], NDArray[np.float32]] | None:
        """What a real robot sent in one attempt.

        Returns:
            Wire values 0..1023, shape ``(n_steps, n_sensors)``, and body states, shape ``(n_steps + 1, n_state)``, with
            no columns where nobody knows them. None if nothing was kept: a simulated robot can repeat the trial, and
            of a trial that a host's crash cut off only the result may be known.
        """
        rows = self.rows("trace", "WHERE attempt = ?", attempt)
        with understood(self.path):
            try:
                return unpack_sensor_trace(rows[0][1], rows[0][2]) if rows else None
            except zlib.error as error:
                raise ValueError(f"the sensors of trial {attempt}: {error}") from error

    # -- sessions, measurements, events -----------------------------------------------------------------------------

    def sessions(self) -> list[SessionRow]:
        """All processes that worked on the run in order."""
        with understood(self.path):
            return [session_row(dict(zip(columns_of("session"), row, strict=True))) for row in self.rows("session")]

    def measurements(self) -> list[MeasurementRow]:
        """All measurements outside evolution in order."""
        return [MeasurementRow(*row) for row in self.rows("measurement", "ORDER BY id")]

    def spent(self, robot: str | None = None) -> SpentRow:
        """What the run has used up so far.

        Args:
            robot: only what was done with a robot of this name.
        """
        sessions = [row for row in self.rows("session") if robot in (None, row[2])]
        wall_s, attempts, ended, robot_s = (sum(row[column] for row in sessions) for column in (5, 7, 8, 9))
        mine = "(?1 IS NULL OR session IS NULL OR session IN (SELECT id FROM session WHERE robot = ?1))"
        charges = self.one(
            "SELECT coalesce(sum(max(0, drop_)), 0) FROM (SELECT lag(battery) OVER (ORDER BY id) - battery AS drop_ "
            f"FROM attempt WHERE battery IS NOT NULL AND {mine})",
            robot,
        )[0]
        return SpentRow(float(robot_s), float(wall_s), attempts, attempts - ended, charges)

    def costs(self) -> list[tuple[int, int, float, float]]:
        """(generation, attempts that ended, their robot time, their operators' time) of all generations, in order."""
        costs = [
            (row.number, row.attempts or 0, row.robot_s or 0.0, row.operator_s or 0.0)
            for row in self.generations(finished=True)
        ]
        newest = self.last_generation()
        if newest is not None and newest.finished_at is None:
            ended = [row for row in self.attempts(newest.number) if row.robot_s is not None]
            operator_s = sum(row.operator_s or 0.0 for row in ended)
            costs.append((newest.number, len(ended), sum(row.robot_s or 0.0 for row in ended), operator_s))
        return [cost for cost in costs if cost[1]]

    def operator_s(self) -> float:
        """What a person needed at the prompts of all attempts."""
        return float(sum(row[10] for row in self.rows("session")))

    def limits(self, robot: str | None = None) -> dict[str, float | None] | None:
        """The budgets of the newest session (with a robot of this name); None before there is one."""
        rows = self.rows("session", "WHERE ?1 IS NULL OR robot = ?1 ORDER BY id DESC LIMIT 1", robot)
        with understood(self.path):
            return json.loads(rows[0][4]) if rows else None

    def events(self) -> list[tuple[str, int | None, str, str]]:
        """(time, generation, kind, message) of all events in order."""
        return [row[1:] for row in self.rows("event", "ORDER BY id")]

    def _attempts(self, where: str, *values: Any) -> list[AttemptRow]:
        rows = self.rows("attempt", where, *values)
        with understood(self.path):
            if len(rows) == 1 and self._schema >= FIRST_WITH_CHECKSUMS:
                return [attempt_row(rows[0], self._starts_of(rows))]
            return attempt_rows(rows, self._starts_of(rows))

    def _starts_of(self, rows: list[tuple[Any, ...]]) -> dict[int, tuple[float, ...]]:
        """Those that some attempts have: where every trial has its own, a run has as many as trials."""
        if not rows:
            return {}
        ids = [row[9] for row in rows if isinstance(row[9], int)]
        if self._schema < FIRST_WITH_CHECKSUMS or len(ids) < len(rows):
            return self.starts()
        found = self.rows("start", "WHERE id BETWEEN ? AND ?", min(ids), max(ids))
        return {row[0]: tuple(json.loads(row[1])) for row in found}

    def starts(self) -> dict[int, tuple[float, ...]]:
        """Start values by their id."""
        return {row[0]: tuple(json.loads(row[1])) for row in self.rows("start")}


def _within_64_bits(number: int) -> int:
    return number if -(2**63) <= number < 2**63 else -1

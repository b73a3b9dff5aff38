"""Reading a journal, also while another process writes it."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import NotARun, RunIsDamaged, RunIsNewer
from sceann_hil.journal import schema1
from sceann_hil.journal.entries import AttemptKind
from sceann_hil.journal.measured import unpack_measured
from sceann_hil.journal.rows import (
    AttemptRow,
    GenerationRow,
    IndividualRow,
    MeasurementRow,
    RunRow,
    SessionRow,
    SpentRow,
)
from sceann_hil.journal.schema import APPLICATION_ID, JOURNAL_NAME, SCHEMA_VERSION, UNBORN_NAME
from sceann_hil.robot import EndReason

_GENERATION = (
    "number, finished_at, wall_s, robot_s, best_fitness, mean_fitness, worst_fitness, success_rate FROM generation"
)
_INDIVIDUAL = "id, generation, number, genome, parent, structure, fitness FROM individual"
_ATTEMPT = (
    "id, kind, session, generation, individual, trial, attempt, own_genome, start, noise_key, end_reason, steps, "
    "value, state_hash, final_state, robot_s, fitness, operator_s, battery, note, measurement FROM attempt"
)


def open_database(directory: Path, *, write: bool) -> sqlite3.Connection:
    """A connection to a run's journal, after a look at whether it is one.

    Raises:
        NotARun: no folder, no journal in it, or a file that is something else.
        RunIsNewer: its schema is newer than this version's.
        RunIsDamaged: SQLite cannot read it.
    """
    path = directory / JOURNAL_NAME
    if not path.is_file() and any(directory.glob(f"{UNBORN_NAME}*")):
        raise NotARun(
            f"{directory} is not a run: its process ended before the run began.",
            "Start it again with `sceann evolve`, with the same --out.",
        )
    if not path.is_file():
        what = "has no journal" if directory.is_dir() else "does not exist"
        raise NotARun(
            f"{directory} is not a run: it {what}.", "Name the folder that `sceann evolve` printed (its --out)."
        )
    db = sqlite3.connect(
        f"{path.absolute().as_uri()}?mode={'rw' if write else 'ro'}", uri=True, isolation_level=None, timeout=30.0
    )
    try:
        application = db.execute("PRAGMA application_id").fetchone()[0]
        version = db.execute("PRAGMA user_version").fetchone()[0]
        if application == APPLICATION_ID and write:
            db.execute("PRAGMA journal_mode = WAL")
            db.execute("PRAGMA synchronous = FULL")
            db.execute("PRAGMA foreign_keys = ON")
    except sqlite3.DatabaseError as error:
        db.close()
        if isinstance(error, sqlite3.OperationalError):
            raise
        raise RunIsDamaged(
            f"{path} cannot be read: {error}.", "Restore it from a backup; `sqlite3 FILE .recover` may save a part."
        ) from None
    if application != APPLICATION_ID:
        db.close()
        raise NotARun(f"{path} is not a journal of this program.", "Name the folder that `sceann evolve` printed.")
    if version > SCHEMA_VERSION:
        db.close()
        raise RunIsNewer(
            f"{directory} was written by a newer version: its schema is {version}, this one knows up to "
            f"{SCHEMA_VERSION}.",
            "Update sceann-hil.",
        )
    if version < SCHEMA_VERSION and write:
        schema1.bring_up_to_date(db)
    elif version < SCHEMA_VERSION:
        schema1.read_as_today(db)
    return db


class JournalReader:
    """Questions to a run's journal."""

    def __init__(self, directory: Path, database: sqlite3.Connection | None = None) -> None:
        """Open the journal in `directory` for reading, or use a connection that is open already.

        Raises:
            NotARun, RunIsNewer, RunIsDamaged: see `open_database`.
        """
        self.directory = directory
        self._db = database or open_database(directory, write=False)

    def close(self) -> None:
        """Let go of the file. May be called twice."""
        self._db.close()

    def run(self) -> RunRow:
        """The run itself."""
        row = self._db.execute("SELECT name, created_at, root_seed, config, versions, parent_run FROM run").fetchone()
        return RunRow(row[0], row[1], row[2], row[3], json.loads(row[4]), row[5])

    def generations(self, *, finished: bool = False) -> list[GenerationRow]:
        """All generations in order, or only those that are finished."""
        where = " WHERE finished_at IS NOT NULL" if finished else ""
        return [GenerationRow(*row) for row in self._db.execute(f"SELECT {_GENERATION}{where} ORDER BY number")]

    def last_generation(self) -> GenerationRow | None:
        """The newest generation, finished or not; None in a run that has not begun."""
        row = self._db.execute(f"SELECT {_GENERATION} ORDER BY number DESC LIMIT 1").fetchone()
        return GenerationRow(*row) if row else None

    def algorithm_state(self, generation: int) -> bytes:
        """The algorithm's state that a generation began with."""
        row = self._db.execute("SELECT algorithm_state FROM generation WHERE number = ?", (generation,)).fetchone()
        return bytes(row[0])

    def individuals(self, generation: int) -> list[IndividualRow]:
        """A generation's individuals in order."""
        rows = self._db.execute(f"SELECT {_INDIVIDUAL} WHERE generation = ? ORDER BY number", (generation,))
        return [IndividualRow(*row) for row in rows]

    def fitness(self, generation: int) -> NDArray[np.float64]:
        """Fitness of a finished generation's individuals in order, shape ``(population,)``."""
        rows = self._db.execute("SELECT fitness FROM individual WHERE generation = ? ORDER BY number", (generation,))
        return np.array([row[0] for row in rows], np.float64)

    def individual(self, identity: int) -> IndividualRow:
        """One individual by its id.

        Raises:
            NotARun: the run has no such individual.
        """
        row = self._db.execute(f"SELECT {_INDIVIDUAL} WHERE id = ?", (identity,)).fetchone()
        if row is None:
            last = self._db.execute("SELECT coalesce(max(id), 0) FROM individual").fetchone()[0]
            raise NotARun(
                f"{self.directory} has no individual {identity}.", f"Individuals are numbered from 1 to {last}."
            )
        return IndividualRow(*row)

    def champion(self) -> IndividualRow | None:
        """The best individual of the last finished generation; the first of equals. None before there is one."""
        row = self._db.execute(
            f"SELECT {_INDIVIDUAL} WHERE generation = (SELECT max(number) FROM generation WHERE finished_at IS NOT "
            "NULL) ORDER BY fitness DESC, number LIMIT 1"
        ).fetchone()
        return IndividualRow(*row) if row else None

    def best_ever(self) -> IndividualRow | None:
        """The best individual of all finished generations; the first of equals. None before there is one."""
        row = self._db.execute(
            f"SELECT {_INDIVIDUAL} WHERE fitness IS NOT NULL ORDER BY fitness DESC, generation, number LIMIT 1"
        ).fetchone()
        return IndividualRow(*row) if row else None

    def attempts(self, generation: int) -> list[AttemptRow]:
        """A generation's attempts in the order of their ids."""
        return list(self._attempts("WHERE generation = ? ORDER BY id", generation))

    def attempt(self, identity: int) -> AttemptRow:
        """One attempt by its id.

        Raises:
            NotARun: the run has no such trial.
        """
        for row in self._attempts("WHERE id = ?", identity):
            return row
        last = self.count_attempts()
        known = f"Trials are numbered from 1 to {last}." if last else "It has no trials yet."
        raise NotARun(f"{self.directory} has no trial {identity}.", known)

    def measured(self, attempt: int) -> tuple[NDArray[np.uint16], NDArray[np.float32]] | None:
        """What a real robot sent in one attempt.

        Returns:
            Wire values 0..1023, shape ``(n_steps, n_sensors)``, and body states, shape ``(n_steps + 1, n_state)``, with
            no columns where nobody knows them. None if nothing was kept: a simulated robot can repeat the trial, and
            of a trial that a host's crash cut off only the result may be known.
        """
        row = self._db.execute("SELECT format, data FROM trace WHERE attempt = ?", (attempt,)).fetchone()
        return unpack_measured(row[0], row[1]) if row else None

    def count_attempts(self) -> int:
        """The highest attempt id so far."""
        return int(self._db.execute("SELECT coalesce(max(id), 0) FROM attempt").fetchone()[0])

    def attempts_of_genome(self, genome: str, before_generation: int) -> list[AttemptRow]:
        """Counted attempts of a genome (hexadecimal) in generations before one, in the order of their ids."""
        return list(
            self._attempts(
                "WHERE fitness IS NOT NULL AND (generation, individual) IN (SELECT generation, number FROM individual "
                "WHERE genome = ? AND generation < ?) ORDER BY id",
                genome,
                before_generation,
            )
        )

    def attempts_of_kind(self, kind: AttemptKind) -> list[AttemptRow]:
        """All attempts of a kind other than evolution in the order of their ids."""
        return list(self._attempts("WHERE kind = ? AND kind <> 'evolution' ORDER BY id", kind.value))

    def sessions(self) -> list[SessionRow]:
        """All processes that worked on the run in order."""
        rows = self._db.execute(
            "SELECT id, started_at, robot, operators, wall_s, paused_s, versions, body FROM session ORDER BY id"
        )
        return [
            SessionRow(identity, started_at, robot, operators, wall_s, paused_s, json.loads(versions), body)
            for identity, started_at, robot, operators, wall_s, paused_s, versions, body in rows
        ]

    def measurements(self) -> list[MeasurementRow]:
        """All measurements outside evolution in order."""
        rows = self._db.execute(
            "SELECT id, kind, begun_at, finished_at, robot, config, plan FROM measurement ORDER BY id"
        )
        return [MeasurementRow(*row) for row in rows]

    def attempts_of_measurement(self, measurement: int) -> list[AttemptRow]:
        """A measurement's attempts in the order of their ids."""
        return list(
            self._attempts(
                "WHERE kind = 'measurement' AND kind <> 'evolution' AND measurement = ? ORDER BY id", measurement
            )
        )

    def attempts_since_reference(self) -> int:
        """Attempts of evolution that ended since the newest run of the reference genome, in all sessions."""
        newest = self._db.execute(
            "SELECT coalesce(max(id), 0) FROM attempt WHERE kind = 'reference' AND kind <> 'evolution'"
        ).fetchone()[0]
        return int(
            self._db.execute(
                "SELECT count(end_reason) FROM attempt WHERE id > ? AND kind = 'evolution'", (newest,)
            ).fetchone()[0]
        )

    def spent(self, robot: str | None = None) -> SpentRow:
        """What the run has used up so far.

        Args:
            robot: only what was done with a robot of this name, or in a session that is not known.
        """
        mine = "(?1 IS NULL OR session IS NULL OR session IN (SELECT id FROM session WHERE robot = ?1))"
        robot_s, trials, ended = self._db.execute(
            f"SELECT coalesce(sum(robot_s), 0), count(*), count(end_reason) FROM attempt WHERE {mine}", (robot,)
        ).fetchone()
        wall_s = self._db.execute(
            "SELECT coalesce(sum(wall_s), 0) FROM session WHERE ?1 IS NULL OR robot = ?1", (robot,)
        ).fetchone()[0]
        charges = self._db.execute(
            "SELECT coalesce(sum(max(0, drop_)), 0) FROM (SELECT lag(battery) OVER (ORDER BY id) - battery AS drop_ "
            f"FROM attempt WHERE battery IS NOT NULL AND {mine})",
            (robot,),
        ).fetchone()[0]
        return SpentRow(robot_s, wall_s, trials, trials - ended, charges)

    def costs(self) -> list[tuple[int, int, float, float]]:
        """(generation, attempts that ended, their robot time, their operators' time) of all generations, in order."""
        return self._db.execute(
            "SELECT generation, count(*), sum(robot_s), coalesce(sum(operator_s), 0) FROM attempt "
            "WHERE generation IS NOT NULL AND robot_s IS NOT NULL GROUP BY generation ORDER BY generation"
        ).fetchall()

    def operator_s(self) -> float:
        """What a person needed at the prompts of all attempts."""
        return float(self._db.execute("SELECT coalesce(sum(operator_s), 0) FROM attempt").fetchone()[0])

    def limits(self, robot: str | None = None) -> dict[str, float | None] | None:
        """The budgets of the newest session (with a robot of this name); None before there is one."""
        row = self._db.execute(
            "SELECT limits FROM session WHERE ?1 IS NULL OR robot = ?1 ORDER BY id DESC LIMIT 1", (robot,)
        ).fetchone()
        return None if row is None else json.loads(row[0])

    def events(self) -> list[tuple[str, int | None, str, str]]:
        """(time, generation, kind, message) of all events in order."""
        return self._db.execute("SELECT at, generation, kind, message FROM event ORDER BY id").fetchall()

    def _attempts(self, where: str, *values: int | str) -> Iterator[AttemptRow]:
        for row in self._db.execute(f"SELECT {_ATTEMPT} {where}", values):
            yield AttemptRow(
                id=row[0],
                kind=AttemptKind(row[1]),
                session=row[2],
                generation=row[3],
                individual=row[4],
                trial=row[5],
                attempt=row[6],
                genome=row[7],
                start=tuple(json.loads(row[8])),
                noise_key=int(row[9] or "0", 16),
                end_reason=None if row[10] is None else EndReason[row[10].upper()],
                steps=row[11],
                value=row[12],
                state_hash=row[13],
                final_state=None if row[14] is None else tuple(json.loads(row[14])),
                robot_s=row[15],
                fitness=row[16],
                operator_s=row[17],
                battery=row[18],
                note=row[19],
                measurement=row[20],
            )


def trial_arrays(attempts: list[AttemptRow]) -> tuple[NDArray[np.float64], NDArray[np.uint64], NDArray[np.int64]]:
    """Starts, noise keys and ids of attempts as `sceann_hil.robot.Trials` wants them."""
    return (
        np.array([a.start for a in attempts], np.float64),
        np.array([a.noise_key for a in attempts], np.uint64),
        np.array([a.id for a in attempts], np.int64),
    )

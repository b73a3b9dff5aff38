"""Writing a journal: intent before a trial, result after it, the algorithm's state with every generation."""

from __future__ import annotations

import json
import sqlite3
import time
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import RunExists
from sceann_hil.journal.entries import NOTHING_SPECIAL, AttemptKind, Circumstances, FirstGeneration, Slots
from sceann_hil.journal.measured import pack_measured
from sceann_hil.journal.reader import JournalReader, open_database
from sceann_hil.journal.schema import APPLICATION_ID, JOURNAL_NAME, SCHEMA, SCHEMA_VERSION, UNBORN_NAME
from sceann_hil.network.coding import Bits, genome_to_hex
from sceann_hil.robot import EndReason, Results
from sceann_hil.versions import running_versions


class Journal:
    """The writing side of a run's journal; the caller holds the `RunLock`.

    Every method is one transaction: it is on disk when the method returns, or it has not happened.

    Attributes:
        reader: the reading side, over the same connection.
    """

    def __init__(self, directory: Path) -> None:
        """Open an existing journal.

        Raises:
            NotARun, RunIsNewer, RunIsDamaged: see `open_database`.
        """
        self._db = open_database(directory, write=True)
        self.reader = JournalReader(directory, self._db)
        self._session: int | None = None
        self._session_began_s = time.monotonic()

    @classmethod
    def create(
        cls,
        directory: Path,
        *,
        name: str,
        root_seed: int,
        config: str,
        versions: dict[str, str],
        parent_run: str | None = None,
        first: FirstGeneration | None = None,
    ) -> Self:
        """Start the journal of a new run.

        Args:
            directory: where; it exists.
            name: of the experiment.
            root_seed: of the seed tree.
            config: YAML with every default spelled out.
            versions: of what it runs on.
            parent_run: directory of the run whose population this one starts from.
            first: generation 0, if it comes from there.

        Raises:
            RunExists: there is a journal already.
        """
        path = directory / JOURNAL_NAME
        if path.exists():
            raise RunExists(f"{directory} already holds a run.", "Choose another --out, or `sceann resume` this run.")
        # the file gets its name only when it is whole: a process killed here leaves no half-made run
        for leftover in filter(cls.is_unborn, directory.iterdir()):
            leftover.unlink()
        making = directory / UNBORN_NAME
        db = sqlite3.connect(making, isolation_level=None)
        db.executescript(f"BEGIN; {SCHEMA} PRAGMA application_id = {APPLICATION_ID};")
        db.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
        db.execute(
            "INSERT INTO run VALUES (1, ?, ?, ?, ?, ?, ?)",
            (name, _now(), root_seed, config, json.dumps(versions), parent_run),
        )
        if first is not None:
            _insert_generation(db, 0, first.state, first.genomes, first.parents, first.structures)
        db.execute("COMMIT")
        db.close()
        making.rename(path)
        return cls(directory)

    @staticmethod
    def is_unborn(path: Path) -> bool:
        """True for a file that `create` leaves behind if it is killed; it holds nothing."""
        return path.name.startswith(UNBORN_NAME)

    def begin_generation(
        self,
        number: int,
        state: bytes,
        genomes: Bits,
        parents: Sequence[int | None],
        structures: Sequence[str | None],
    ) -> None:
        """A new generation is about to be evaluated.

        Args:
            number: of the generation, from 0.
            state: the algorithm's state.
            genomes: bits, shape ``(population, L)``.
            parents: ids of the parents.
            structures: what the algorithm keeps of each besides the bits.
        """
        with self._transaction():
            _insert_generation(self._db, number, state, genomes, parents, structures)

    def intend(
        self,
        generation: int | None,
        slots: Slots,
        starts: NDArray[np.float64],
        keys: NDArray[np.uint64],
        kind: AttemptKind = AttemptKind.EVOLUTION,
        genomes: Sequence[str] | None = None,
        measurement: int | None = None,
    ) -> NDArray[np.int64]:
        """These attempts are about to start.

        Args:
            generation: the generation's number; None for other kinds than evolution.
            slots: what they are for.
            starts: start values, shape ``(n, n_start)``.
            keys: noise keys, shape ``(n,)``.
            kind: what they are for, the same for all.
            genomes: of other kinds than evolution, each attempt's genome in hexadecimal.
            measurement: which they belong to, from `begin_measurement`.

        Returns:
            The attempts' ids, int64, shape ``(n,)``: consecutive, in the order given.
        """
        now = _now()
        with self._transaction():
            first = int(self._db.execute("SELECT coalesce(max(id), 0) + 1 FROM attempt").fetchone()[0])
            no_genomes: list[str | None] = [None] * len(slots)
            ids = np.arange(first, first + len(slots), dtype=np.int64)
            self._db.executemany(
                "INSERT INTO attempt (id, kind, session, measurement, generation, individual, trial, attempt, "
                "own_genome, start, noise_key, intent_at) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    (
                        *(identity, kind.value, self._session, measurement, generation, i, t, a, genome),
                        json.dumps(start),
                        *(f"{key:016x}", now),
                    )
                    for identity, i, t, a, genome, start, key in zip(
                        ids.tolist(),
                        slots.individual.tolist(),
                        slots.trial.tolist(),
                        slots.attempt.tolist(),
                        genomes or no_genomes,
                        starts.tolist(),
                        keys.tolist(),
                        strict=True,
                    )
                ],
            )
        return ids

    def begin_measurement(self, kind: str, robot: str, config: str, plan: str) -> int:
        """Genomes are about to be run on a robot outside evolution.

        Args:
            kind: what for, in a word.
            robot: its name.
            config: YAML: the configuration that the measurement is made with.
            plan: JSON: what was asked for.

        Returns:
            The measurement's id.
        """
        with self._transaction():
            inserted = self._db.execute(
                "INSERT INTO measurement (kind, begun_at, robot, config, plan) VALUES (?, ?, ?, ?, ?) RETURNING id",
                (kind, _now(), robot, config, plan),
            )
            return int(inserted.fetchone()[0])

    def finish_measurement(self, identity: int) -> None:
        """All trials of a measurement are counted."""
        with self._transaction():
            self._db.execute("UPDATE measurement SET finished_at = ? WHERE id = ?", (_now(), identity))

    def begin_session(
        self,
        robot: str,
        operators: str,
        limits: dict[str, float | None],
        versions: dict[str, str] | None = None,
        body: str | None = None,
    ) -> None:
        """This process begins to work on the run.

        Args:
            robot: name of the robot.
            operators: who stands beside it.
            limits: budgets in force.
            versions: what it runs on; by default what this process runs on.
            body: fingerprint of the simulated body's code; None where there is none.
        """
        self._session_began_s = time.monotonic()
        with self._transaction():
            inserted = self._db.execute(
                "INSERT INTO session (started_at, robot, operators, limits, wall_s, paused_s, versions, body) "
                "VALUES (?, ?, ?, ?, 0, 0, ?, ?) RETURNING id",
                (_now(), robot, operators, json.dumps(limits), json.dumps(versions or running_versions()), body),
            )
            self._session = int(inserted.fetchone()[0])

    def record(
        self,
        ids: NDArray[np.int64],
        results: Results,
        fitness: NDArray[np.float64],
        circumstances: Circumstances = NOTHING_SPECIAL,
    ) -> None:
        """These attempts have ended.

        Args:
            ids: from `intend`.
            results: what happened, in the same order.
            fitness: of each trial, shape ``(n,)``; ignored where the end was void.
            circumstances: the same for all of them.

        Traces in the results are kept too: a robot that delivers them with `run` cannot be asked for them later.
        """
        now, about = _now(), (circumstances.operator_s, circumstances.battery_fraction, circumstances.note)
        reasons = [EndReason(r) for r in results.end_reasons.tolist()]
        with self._transaction():
            self._db.executemany(
                "UPDATE attempt SET ended_at = ?, end_reason = ?, steps = ?, value = ?, state_hash = ?, "
                "final_state = ?, robot_s = ?, fitness = ?, operator_s = ?, battery = ?, "
                # what was said of it while it ran is there already
                "note = coalesce(note || '; ' || ?11, ?11, note) WHERE id = ?12",
                [
                    (now, reason.name.lower(), steps, value, crc, json.dumps(final), robot_s, worth, *about, identity)
                    for reason, steps, value, crc, final, robot_s, worth, identity in zip(
                        reasons,
                        results.steps.tolist(),
                        [None] * len(ids) if results.values is None else _unless_void(reasons, results.values),
                        results.hashes.tolist(),
                        results.final_states.tolist(),
                        results.durations_s.tolist(),
                        _unless_void(reasons, fitness),
                        ids.tolist(),
                        strict=True,
                    )
                ],
            )
            self._db.execute(
                "UPDATE session SET wall_s = ?, paused_s = ? WHERE id = ?",
                (time.monotonic() - self._session_began_s, circumstances.paused_s, self._session),
            )
            if results.traces is not None:
                self._db.executemany(
                    "INSERT INTO trace (attempt, format, data) VALUES (?, ?, ?)",
                    [
                        (identity, *pack_measured(trace))
                        for identity, trace in zip(ids.tolist(), results.traces, strict=True)
                    ],
                )

    def annotate(self, attempt: int, words: str) -> None:
        """Add an operator's words to an attempt."""
        with self._transaction():
            self._db.execute(
                "UPDATE attempt SET note = CASE WHEN note IS NULL THEN ?1 ELSE note || '; ' || ?1 END WHERE id = ?2",
                (words, attempt),
            )

    def finish_generation(self, number: int, fitness: NDArray[np.float64], wall_s: float, success_rate: float) -> None:
        """All trials of a generation are counted; `fitness` has shape ``(population,)``."""
        with self._transaction():
            self._db.executemany(
                "UPDATE individual SET fitness = ? WHERE generation = ? AND number = ?",
                [(value, number, i) for i, value in enumerate(fitness.tolist())],
            )
            self._db.execute(
                "UPDATE generation SET finished_at = ?, wall_s = ?, best_fitness = ?, mean_fitness = ?, "
                "worst_fitness = ?, success_rate = ?, "
                "robot_s = (SELECT sum(robot_s) FROM attempt WHERE generation = number) WHERE number = ?",
                (_now(), wall_s, fitness.max(), fitness.mean(), fitness.min(), success_rate, number),
            )

    def note(self, kind: str, message: str, generation: int | None = None) -> None:
        """Something worth remembering: started, resumed, stopped, finished."""
        with self._transaction():
            self._db.execute(
                "INSERT INTO event (at, generation, kind, message) VALUES (?, ?, ?, ?)",
                (_now(), generation, kind, message),
            )

    def close(self) -> None:
        """Fold the write-ahead log into the file. May be called twice."""
        self._db.close()

    def _transaction(self) -> _Transaction:
        return _Transaction(self._db)


def _insert_generation(
    db: sqlite3.Connection,
    number: int,
    state: bytes,
    genomes: Bits,
    parents: Sequence[int | None],
    structures: Sequence[str | None],
) -> None:
    db.execute("INSERT INTO generation (number, algorithm_state, started_at) VALUES (?, ?, ?)", (number, state, _now()))
    db.executemany(
        "INSERT INTO individual (generation, number, genome, parent, structure) VALUES (?, ?, ?, ?, ?)",
        [
            (number, i, genome_to_hex(genome), parent, structure)
            for i, (genome, parent, structure) in enumerate(zip(genomes, parents, structures, strict=True))
        ],
    )


def _unless_void(reasons: list[EndReason], values: NDArray[np.float64]) -> list[float | None]:
    return [None if reason.is_void else value for reason, value in zip(reasons, values.tolist(), strict=True)]


class _Transaction:
    """Commit at the end of the block; roll back, whatever was raised, in the middle of it."""

    def __init__(self, db: sqlite3.Connection) -> None:
        self._db = db

    def __enter__(self) -> None:
        self._db.execute("BEGIN IMMEDIATE")

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._db.execute("COMMIT")
        elif self._db.in_transaction:
            self._db.execute("ROLLBACK")


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")

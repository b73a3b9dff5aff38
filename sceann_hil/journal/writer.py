"""Writing a journal: intent before a trial, result after it, the algorithm's state with every generation."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import OtherVersions
from sceann_hil.journal import schema1, schema2
from sceann_hil.journal.attempts import final_state_texts
from sceann_hil.journal.checksums import Column, row_checksums
from sceann_hil.journal.database import as_ours, open_database, understood
from sceann_hil.journal.entries import NOTHING_SPECIAL, AttemptKind, Circumstances, FirstGeneration, Slots
from sceann_hil.journal.insertion import (
    insert_columns,
    insert_generation,
    insert_row,
    milliseconds,
    now_text,
    readable,
    rewrite_digests,
    unless,
    update_checksums,
    update_columns,
    write_finished_digest,
)
from sceann_hil.journal.intents import INTENT, RESULT, Intents, Written
from sceann_hil.journal.making import is_unborn, make_journal
from sceann_hil.journal.reader import KIND, JournalReader, journal_path
from sceann_hil.journal.schema import FIRST_WITH_CHECKSUMS, SCHEMA_VERSION, columns_of
from sceann_hil.journal.seal import Sealer
from sceann_hil.journal.sensor_traces import pack_sensor_trace
from sceann_hil.journal.transactions import Transactions
from sceann_hil.journal.verify import require_sound
from sceann_hil.network.coding import Bits
from sceann_hil.robot import EndReason, Results, RobotSpec
from sceann_hil.versions import running_versions, version_differences


class Journal:
    """The writing side of a run's journal; the caller holds the `RunLock`.

    Every method is one transaction: it is on disk when the method returns, or it has not happened.

    Attributes:
        reader: the reading side, over the same connection.
        accept_other_versions: a session may run on other versions, or another body, than the one before.
    """

    accept_other_versions = False

    def __init__(self, directory: Path) -> None:
        """Open an existing journal, once nothing in it is damaged; one of an older schema is brought up to date.

        Raises:
            NotARun, RunIsNewer, RunIsDamaged, CannotRead, CannotWrite: see `open_database` and `require_sound`.
        """
        path = journal_path(directory)
        require_sound(directory)
        self._db, version = open_database(KIND, path, write=True)
        try:
            if version < SCHEMA_VERSION:
                older = schema1 if version < FIRST_WITH_CHECKSUMS else schema2
                with as_ours(path):
                    older.bring_up_to_date(self._db)
            self._transaction = Transactions(self._db, path, Sealer(path))
        except BaseException:
            self._db.close()
            raise
        self.reader = JournalReader(directory, self._db)
        self._session: dict[str, Any] | None = None
        self._session_began_s = time.monotonic()
        self._intents = Intents(self._db, self.reader)
        self._fresh: Written | None = None
        """The newest intents, while nothing else was written to them."""

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
        robot: RobotSpec | None = None,
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
            robot: what is known of it, for whoever looks at the run without the package that knows it.

        Raises:
            RunExists: there is a journal already.
        """
        row = (readable(name), now_text(), root_seed, config, json.dumps(versions), parent_run and readable(parent_run))
        make_journal(directory, row, first, json.dumps(asdict(robot)) if robot is not None else None)
        return cls(directory)

    is_unborn = staticmethod(is_unborn)

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
        with self._transaction:
            insert_generation(self._db, number, state, genomes, parents, None, structures)

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
        n, session = len(slots), None if self._session is None else self._session["id"]
        with self._transaction:
            first = self.reader.count_attempts() + 1
            ids = np.arange(first, first + n, dtype=np.int64)
            columns: list[Column] = [
                *(ids, kind.value, session, measurement, generation, slots.individual, slots.trial, slots.attempt),
                *(genomes, self._intents.start_ids(starts), keys.astype(np.uint64, copy=False).view(np.int64)),
                milliseconds(),
            ]
            fresh = self._intents.write(columns, n)
            self._add_to_session(attempts=n)
        self._fresh = fresh
        return ids

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
        n, said = len(ids), None if circumstances.note is None else readable(circumstances.note)
        names = {code: EndReason(code).name.lower() for code in set(results.end_reasons.tolist())}
        counts = results.counts
        is_void = None if counts.all() else ~counts
        fresh, known, notes = self._written(ids)
        learned: list[Column] = [
            *(milliseconds(), [names[code] for code in results.end_reasons.tolist()], results.steps),
            *(unless(is_void, results.values), results.hashes, final_state_texts(results.final_states)),
            *(results.durations_s, unless(is_void, fitness), circumstances.operator_s, circumstances.battery_fraction),
            [_joined(note, said) for note in notes] if notes is not None else said,
        ]
        checksums = row_checksums([*known, *learned], n)
        with self._transaction:
            if fresh is not None and fresh.as_batch:
                insert_columns(self._db, "attempt", [*INTENT, *RESULT], [*known, *learned], checksums, n)
                self._intents.forget(fresh)
            else:
                update_columns(self._db, "attempt", RESULT, learned, checksums, ids.tolist())
            self._add_to_session(
                ended=n,
                robot_s=float(results.durations_s.sum()),
                operator_s=n * (circumstances.operator_s or 0.0),
                paused_s=circumstances.paused_s,
            )
            for identity, trace in zip(ids.tolist(), results.traces or (), strict=results.traces is not None):
                insert_row(self._db, "trace", (identity, *pack_sensor_trace(trace)))

    def annotate(self, attempt: int, words: str) -> None:
        """Add an operator's words to an attempt."""
        self._spread()
        with self._transaction:
            (row,) = self.reader.rows("attempt", "WHERE id = ?", attempt)
            self._db.execute("UPDATE attempt SET note = ? WHERE id = ?", (_joined(row[-1], readable(words)), attempt))
            update_checksums(self._db, "attempt", "WHERE id = ?", attempt)
            rewrite_digests(self._db, since_attempt=attempt)

    def finish_generation(self, number: int, fitness: NDArray[np.float64], wall_s: float, success_rate: float) -> None:
        """All trials of a generation are counted; `fitness` has shape ``(population,)``."""
        with self._transaction:
            self._write_fitness(number, fitness)
            own = (
                "FROM attempt WHERE id > (SELECT coalesce(max(last_attempt), 0) FROM generation WHERE number = ?1 - 1) "
                "AND generation = ?1 AND end_reason IS NOT NULL"
            )
            attempts, robot_s, operator_s = self._db.execute(
                f"SELECT count(*), coalesce(sum(robot_s), 0.0), coalesce(sum(operator_s), 0.0) {own}", (number,)
            ).fetchone()
            figures = (now_text(), wall_s, attempts, robot_s, operator_s, fitness.max(), fitness.mean(), fitness.min())
            self._db.execute(
                "UPDATE generation SET finished_at = ?, wall_s = ?, attempts = ?, robot_s = ?, operator_s = ?, "
                "best_fitness = ?, mean_fitness = ?, worst_fitness = ?, success_rate = ?, "
                "last_attempt = (SELECT coalesce(max(id), 0) FROM attempt) WHERE number = ?",
                (*figures, success_rate, number),
            )
            write_finished_digest(self._db, number)

    # -- sessions, measurements, events -----------------------------------------------------------------------------

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

        Raises:
            OtherVersions: the session before ran on others, and nobody has set `accept_other_versions`.
        """
        self._session_began_s = time.monotonic()
        self._spread()
        versions = versions or running_versions()
        self._compare_versions(robot, versions, body)
        with self._transaction:
            row = (
                *(1 + self.reader.one("SELECT coalesce(max(id), 0) FROM session")[0], now_text(), robot, operators),
                *(json.dumps(limits), 0.0, 0.0, 0, 0, 0.0, 0.0, json.dumps(versions), body),
            )
            insert_row(self._db, "session", row)
        self._session = dict(zip(columns_of("session"), row, strict=True))

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
        with self._transaction:
            identity = 1 + int(self.reader.one("SELECT coalesce(max(id), 0) FROM measurement")[0])
            insert_row(self._db, "measurement", (identity, kind, now_text(), None, robot, config, plan))
        return identity

    def finish_measurement(self, identity: int) -> None:
        """All trials of a measurement are counted."""
        with self._transaction:
            self._db.execute("UPDATE measurement SET finished_at = ? WHERE id = ?", (now_text(), identity))
            update_checksums(self._db, "measurement", "WHERE id = ?", identity)

    def note(self, kind: str, message: str, generation: int | None = None) -> None:
        """Something worth remembering: started, resumed, stopped, finished."""
        with self._transaction:
            identity = 1 + self.reader.one("SELECT coalesce(max(id), 0) FROM event")[0]
            insert_row(self._db, "event", (identity, now_text(), generation, kind, readable(message)))

    def close(self) -> None:
        """Fold the write-ahead log into the file, and seal it. May be called twice."""
        self._transaction.close()

    # -- details ----------------------------------------------------------------------------------------------------

    def _compare_versions(self, robot: str, versions: dict[str, str], body: str | None) -> None:
        sessions = self.reader.sessions()
        before = sessions[-1] if sessions else None
        if before is None:
            return
        others = version_differences(before.versions, versions)
        if before.robot == robot and None not in (before.body, body) and before.body != body:
            others.append(f"simulated body: its code was {before.body} before, is {body} now")
        if not others:
            return
        if not self.accept_other_versions:
            raise OtherVersions(
                f"{self.reader.directory} would go on with other versions than those of its session {before.id}: "
                f"{'; '.join(others)}.",
                "Go on with the versions of before, or give --accept-versions: then the journal says from which "
                "session on they are others.",
            )
        self.note("versions", f"session {before.id + 1} runs on others than session {before.id}: {'; '.join(others)}")

    def _written(self, ids: NDArray[np.int64]) -> tuple[Written | None, Sequence[Column], list[str | None] | None]:
        """What the rows of some attempts hold since `intend`, and their notes, None if none of them has any."""
        fresh, self._fresh = self._fresh, None
        if fresh is not None and np.array_equal(fresh.ids, ids):
            return fresh, fresh.columns, None
        self._spread()
        rows = [self.reader.rows("attempt", "WHERE id = ?", identity)[0] for identity in ids.tolist()]
        columns = [list(column) for column in zip(*rows, strict=True)]
        return None, columns[: len(INTENT)], columns[-1]

    def _spread(self) -> None:
        """From now on every attempt has a row of its own."""
        self._fresh = None
        if self.reader.one("SELECT count(*) FROM batch")[0]:
            with self._transaction, understood(self.reader.path):
                self._intents.spread()

    def _write_fitness(self, generation: int, fitness: NDArray[np.float64]) -> None:
        rows = self.reader.rows("individual", "WHERE generation = ? ORDER BY number", generation)
        ids, *columns = (list(column) for column in zip(*rows, strict=True))
        columns[-1] = fitness.tolist()
        checksums = row_checksums([ids, *columns], len(ids))
        update_columns(self._db, "individual", ["fitness"], [fitness], checksums, ids)

    def _add_to_session(self, **more: float) -> None:
        if self._session is None:
            return
        for name, value in more.items():
            self._session[name] = value if name == "paused_s" else self._session[name] + value
        if "ended" in more:
            self._session["wall_s"] = time.monotonic() - self._session_began_s
        insert_row(self._db, "session", tuple(self._session.values()), replace=True)


def _joined(before: str | None, words: str | None) -> str | None:
    return f"{before}; {words}" if before and words else before or words

"""A study's results in one SQLite database: who was run already, and what came out of it."""

from __future__ import annotations

import json
import sqlite3
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import config_as_made, config_difference
from sceann_hil.config.text import data_difference
from sceann_hil.errors import NotARun, OtherVersions, RunIsDamaged, StudyChanged, way_out_of_damage
from sceann_hil.journal import RunLock
from sceann_hil.journal.checksums import first_wrong
from sceann_hil.journal.database import DatabaseKind, as_ours, open_database, understood
from sceann_hil.journal.insertion import insert_row
from sceann_hil.journal.seal import Sealer, is_untouched
from sceann_hil.journal.transactions import Transactions
from sceann_hil.journal.verify import Verdict, complaints_of_sqlite
from sceann_hil.places import lacking, make_folder
from sceann_hil.study.blocks import BlockResult
from sceann_hil.study.circumstances import circumstances
from sceann_hil.study.condition import Condition
from sceann_hil.study.config import Study
from sceann_hil.study.making import bring_up_to_date, create_study, identity_text, now_text, read_as_today
from sceann_hil.study.schema import (
    APPLICATION_ID,
    COLUMNS,
    SCHEMA_VERSION,
    STUDY_NAME,
    columns_of,
)
from sceann_hil.versions import version_differences

KIND = DatabaseKind("study", APPLICATION_ID, SCHEMA_VERSION, ("study", "condition", "run", "session"), "sceann study")


@dataclass(frozen=True, slots=True)
class Runs:
    """All finished runs of one condition (n runs), in the order of their numbers.

    Attributes:
        numbers: int64, shape ``(n,)``.
        seeds: root seeds, uint64, shape ``(n,)``.
        fitness: of the champions, float64, shape ``(n,)``.
        successes: trials in which the champion succeeded, int64, shape ``(n,)``.
        genomes: the champions' bits, hexadecimal.
        best: best fitness of every generation, float32, shape ``(n, generations + 1)``.
    """

    numbers: NDArray[np.int64]
    seeds: NDArray[np.uint64]
    fitness: NDArray[np.float64]
    successes: NDArray[np.int64]
    genomes: tuple[str, ...]
    best: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.numbers)


@dataclass(frozen=True, slots=True)
class StudySession:
    """One process that worked on a study, and what it ran on."""

    id: int
    started_at: str
    workers: str
    wall_s: float
    runs: int
    versions: dict[str, str]


@dataclass(frozen=True, slots=True)
class Effort:
    """What a study has cost so far: wall-clock seconds of all sessions, and who computed."""

    wall_s: float
    workers: tuple[str, ...]


class StudyReader:
    """Questions to a study's database, also while it is being filled. Every row is compared with its checksum.

    Raises (every method, too):
        NotARun: no folder, no study in it, or a file that is something else.
        RunIsNewer: its schema is newer than this version's.
        RunIsDamaged: SQLite cannot read it, or a row is not as it was written.
    """

    def __init__(self, directory: Path, database: sqlite3.Connection | None = None, *, checked: bool = True) -> None:
        self.directory = directory
        self.path = directory / STUDY_NAME
        self._schema = SCHEMA_VERSION
        if database is None:
            database, self._schema = open_database(KIND, _study_path(directory), write=False, checked=checked)
        self._db = database
        if self._schema < SCHEMA_VERSION:
            read_as_today(self._db)
        try:
            rows = self.rows("study")
            if not rows:
                raise self._damaged("its study is missing")
            _, self.name, self.about, self.created_at, self.seed, written, versions = rows[0]
            with understood(self.path, "study"):
                self.written: dict[str, Any] = json.loads(written)
                self.versions: dict[str, str] = json.loads(versions)
        except BaseException:
            self._db.close()
            raise

    @property
    def database(self) -> sqlite3.Connection:
        """The connection, for questions that no method asks."""
        return self._db

    def close(self) -> None:
        """Let go of the file. May be called twice."""
        self._db.close()

    def conditions(self) -> list[Condition]:
        """All conditions in order."""
        source = f"{self.directory}: the study's condition"
        versions = {name: version for session in self.sessions() for name, version in session.versions.items()}
        with understood(self.path, "study"):
            return [
                Condition(
                    number,
                    tuple((axis, value) for axis, value in json.loads(settings)),
                    config_as_made(text, source, versions),
                )
                for number, _, settings, text in self.rows("condition", "ORDER BY number")
            ]

    def finished(self, condition: int) -> set[int]:
        """Numbers of the runs of a condition that need not be computed again."""
        with understood(self.path, "study"):
            rows = self._db.execute("SELECT number FROM run WHERE condition = ?", (condition,)).fetchall()
            return {row[0] for row in rows}

    def runs(self, condition: int) -> Runs:
        """All finished runs of a condition."""
        rows = self.rows("run", "WHERE condition = ? ORDER BY number", condition)
        with understood(self.path, "study"):
            columns = list(zip(*rows, strict=True)) if rows else [()] * 8
            best = [np.frombuffer(blob, "<f4").astype(np.float32) for blob in columns[7]]
            return Runs(
                numbers=np.array(columns[1], np.int64),
                seeds=np.array(columns[3], np.uint64),
                fitness=np.array(columns[4], np.float64),
                successes=np.array(columns[5], np.int64),
                genomes=columns[6],
                best=np.stack(best) if best else np.empty((0, 0), np.float32),
            )

    def sessions(self) -> list[StudySession]:
        """All processes that worked on the study in order."""
        with understood(self.path, "study"):
            return [
                StudySession(identity, started_at, workers, wall_s, runs, json.loads(versions))
                for identity, started_at, workers, wall_s, runs, versions in self.rows("session", "ORDER BY id")
            ]

    def effort(self) -> Effort:
        """What the study has cost."""
        rows = [session for session in self.sessions() if session.runs]
        return Effort(sum(row.wall_s for row in rows), tuple(dict.fromkeys(row.workers for row in rows)))

    def rows(self, table: str, where: str = "", *values: Any) -> list[tuple[Any, ...]]:
        """Rows of a table, each compared with its checksum."""
        with understood(self.path, "study"):
            question = f"SELECT {', '.join(columns_of(table))}, checksum FROM {table} {where}"
            rows = self._db.execute(question, values).fetchall()
            wrong = rows and self._schema == SCHEMA_VERSION and first_wrong(rows)
        if wrong:
            place = f"run {wrong[1]} of condition {wrong[0]}" if table == "run" else f"{table} {wrong[0]}"
            raise self._damaged(f"{place} is not as it was written")
        return [row[:-1] for row in rows]

    def _damaged(self, what: str) -> RunIsDamaged:
        return RunIsDamaged(f"{self.path} is damaged: {what}.", way_out_of_damage(self.path, "study"))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class StudyStore(StudyReader):
    """The one writer of a study's database; opened with `begin_or_continue`."""

    def __init__(
        self,
        directory: Path,
        workers: str,
        lock: RunLock,
        versions: dict[str, str],
        *,
        accept_other_versions: bool = False,
    ) -> None:
        self._lock = lock
        self._session: dict[str, Any] = {}
        path = _study_path(directory)
        if verdict := examine_study(directory).damage:
            raise RunIsDamaged(verdict[0], way_out_of_damage(path, "study"))
        db, schema = open_database(KIND, path, write=True)
        try:
            if schema < SCHEMA_VERSION:
                with as_ours(path, "study"):
                    bring_up_to_date(db)
            super().__init__(directory, db)
            self._transaction = Transactions(db, path, Sealer(path), "study")
            self._begin_session(workers, versions, accept_other_versions)
        except BaseException:
            db.close()
            raise

    @classmethod
    def begin_or_continue(
        cls, study: Study, directory: Path, workers: str, *, accept_other_versions: bool = False
    ) -> Self:
        """Open the study in a folder, or make it there.

        Args:
            study: checked.
            directory: its folder.
            workers: who computes.
            accept_other_versions: also on other versions, or with other simulated bodies, than the session before.

        Raises:
            StudyChanged: the folder holds a study with other conditions or another seed.
            OtherVersions: it was begun with other versions.
            RunExists, NotARun, RunIsNewer, RunIsDamaged, RunIsLocked: why not.
        """
        make_folder(directory)
        lock = RunLock(directory)
        try:
            # whether there is one is looked at when nobody else can make it
            if not (directory / STUDY_NAME).exists():
                create_study(study, directory)
            with StudyReader(directory) as reader:
                _check_unchanged(reader, study)
            versions = circumstances(condition.config for condition in study.conditions)
            return cls(directory, workers, lock, versions, accept_other_versions=accept_other_versions)
        except BaseException:
            lock.release()
            raise

    def record(self, result: BlockResult) -> None:
        """Keep a block's runs; all of them or, if anything fails, none."""
        block, session = result.block, self._session["id"]
        columns = (block.seeds, result.fitness, result.successes, result.genomes, result.best.astype("<f4"))
        rows = [
            (
                *(block.condition, block.first_run + k, session, seed, float(fitness), int(successes), genome),
                best.tobytes(),
            )
            for k, (seed, fitness, successes, genome, best) in enumerate(zip(*columns, strict=True))
        ]
        session_now = {
            **self._session,
            "wall_s": time.monotonic() - self._started,
            "runs": self._session["runs"] + len(rows),
        }
        with self._transaction:
            for row in rows:
                insert_row(self._db, "run", row, columns_of=columns_of)
            insert_row(self._db, "session", tuple(session_now.values()), replace=True, columns_of=columns_of)
        self._session = session_now

    def close(self) -> None:
        """Let others write to the study. May be called twice."""
        self._transaction.close()
        self._lock.release()

    def _begin_session(self, workers: str, now: dict[str, str], accept_other_versions: bool) -> None:
        self._started = time.monotonic()
        sessions = self.sessions()
        before = sessions[-1].versions if sessions else self.versions
        if (others := version_differences(before, now)) and not accept_other_versions:
            raise OtherVersions(
                f"{self.directory} would go on with other versions than before: {'; '.join(others)}.",
                "Go on with the versions of before, choose another --out, or give --accept-versions: then the study "
                "says which runs were made with which versions.",
            )
        row = (len(sessions) + 1, now_text(), workers, 0.0, 0, json.dumps(now))
        with self._transaction:
            insert_row(self._db, "session", row, columns_of=columns_of)
        self._session = dict(zip(columns_of("session"), row, strict=True))


def examine_study(directory: Path) -> Verdict:
    """Look at everything in a study's database.

    Raises:
        NotARun, RunIsNewer, CannotRead: there is nothing to look at.
    """
    path = _study_path(directory)
    damage: list[str] = []
    if is_untouched(path):
        return Verdict((), untouched=True)
    try:
        with StudyReader(directory) as reader:
            damage += complaints_of_sqlite(reader.database, path, "study")
            for table in COLUMNS:
                with suppress(RunIsDamaged):
                    reader.rows(table)
                    continue
                damage.append(f"{path} is damaged: a row of table {table} is not as it was written")
            return Verdict(tuple(damage), has_checksums=reader._schema == SCHEMA_VERSION)
    except RunIsDamaged as error:
        return Verdict((*damage, error.message))


def _check_unchanged(reader: StudyReader, study: Study) -> None:
    rows = [(row[1], row[3]) for row in reader.rows("condition", "ORDER BY number")]
    if reader.seed == study.config.seed and rows == [(identity_text(c), c.text) for c in study.conditions]:
        return
    differences = data_difference(reader.written, study.written)
    if not differences:
        # as written the two are equal: has a default changed since, or was one merely added?
        pairs = zip(reader.conditions(), study.conditions, strict=True)
        differences = next(filter(None, (config_difference(old.config, new.config) for old, new in pairs)), [])
    if not differences:
        return
    lines = "\n".join(f"  {difference}" for difference in differences)
    raise StudyChanged(
        f"{reader.directory} holds a study that was begun with another configuration:\n{lines}",
        "Undo the change, or choose another --out for the new study. Only the number of runs may differ.",
    )


def _study_path(directory: Path) -> Path:
    path = directory / STUDY_NAME
    if not path.is_file():
        raise NotARun(
            f"{directory} {lacking(directory, 'holds no study')}.",
            "Name the folder that `sceann study` printed (its --out).",
        )
    return path

"""A study's results in one SQLite database: who was run already, and what came out of it."""

from __future__ import annotations

import json
import sqlite3
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import config_difference, parse_config
from sceann_hil.config.text import data_difference
from sceann_hil.errors import NotARun, RunIsDamaged, RunIsNewer, StudyChanged
from sceann_hil.journal import RunLock
from sceann_hil.study.condition import Condition
from sceann_hil.study.config import Study
from sceann_hil.study.lockstep import BlockResult
from sceann_hil.study.schema import APPLICATION_ID, SCHEMA, SCHEMA_VERSION, STUDY_NAME
from sceann_hil.versions import running_versions


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
class Effort:
    """What a study has cost so far: wall-clock seconds of all sessions, and who computed."""

    wall_s: float
    workers: tuple[str, ...]


class StudyReader:
    """Questions to a study's database, also while it is being filled.

    Raises:
        NotARun: no folder, no study in it, or a file that is something else.
        RunIsNewer: its schema is newer than this version's.
        RunIsDamaged: SQLite cannot read it.
    """

    def __init__(self, directory: Path, database: sqlite3.Connection | None = None) -> None:
        self.directory = directory
        self._db = database or _open(directory, "ro")
        row = self._db.execute("SELECT name, about, created_at, seed, written, versions FROM study").fetchone()
        self.name: str = row[0]
        self.about: str = row[1]
        self.created_at: str = row[2]
        self.seed: int = row[3]
        self.written: dict[str, Any] = json.loads(row[4])
        self.versions: dict[str, str] = json.loads(row[5])

    def close(self) -> None:
        """Let go of the file. May be called twice."""
        self._db.close()

    def conditions(self) -> list[Condition]:
        """All conditions in order."""
        rows = self._db.execute("SELECT number, settings, config FROM condition ORDER BY number")
        source = f"{self.directory}: the study's condition"
        return [
            Condition(number, tuple((axis, value) for axis, value in json.loads(settings)), parse_config(text, source))
            for number, settings, text in rows
        ]

    def finished(self, condition: int) -> set[int]:
        """Numbers of the runs of a condition that need not be computed again."""
        return {row[0] for row in self._db.execute("SELECT number FROM run WHERE condition = ?", (condition,))}

    def runs(self, condition: int) -> Runs:
        """All finished runs of a condition."""
        query = "SELECT number, seed, fitness, successes, genome, best FROM run WHERE condition = ? ORDER BY number"
        rows = self._db.execute(query, (condition,)).fetchall()
        columns = list(zip(*rows, strict=True)) if rows else [()] * 6
        best = [np.frombuffer(blob, "<f4").astype(np.float32) for blob in columns[5]]
        return Runs(
            numbers=np.array(columns[0], np.int64),
            seeds=np.array(columns[1], np.uint64),
            fitness=np.array(columns[2], np.float64),
            successes=np.array(columns[3], np.int64),
            genomes=columns[4],
            best=np.stack(best) if best else np.empty((0, 0), np.float32),
        )

    def effort(self) -> Effort:
        """What the study has cost."""
        rows = self._db.execute("SELECT wall_s, workers FROM session WHERE runs > 0 ORDER BY id").fetchall()
        return Effort(sum(row[0] for row in rows), tuple(dict.fromkeys(row[1] for row in rows)))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class StudyStore(StudyReader):
    """The one writer of a study's database."""

    def __init__(self, directory: Path, workers: str) -> None:
        self._lock = RunLock(directory)
        try:
            super().__init__(directory, _open(directory, "rw"))
        except BaseException:
            self._lock.release()
            raise
        self._started = time.monotonic()
        self._session = self._db.execute(
            "INSERT INTO session (started_at, workers, wall_s, runs) VALUES (?, ?, 0, 0)", (_now(), workers)
        ).lastrowid

    @classmethod
    def begin_or_continue(cls, study: Study, directory: Path, workers: str) -> Self:
        """Open the study in a folder, or make it there.

        Raises:
            StudyChanged: the folder holds a study with other conditions or another seed.
            RunExists, NotARun, RunIsNewer, RunIsDamaged, RunIsLocked: why not.
        """
        if not (directory / STUDY_NAME).exists():
            _create(study, directory)
        store = cls(directory, workers)
        try:
            store._check_unchanged(study)
        except BaseException:
            store.close()
            raise
        return store

    def record(self, result: BlockResult) -> None:
        """Keep a block's runs; all of them or, if anything fails, none."""
        block = result.block
        columns = (block.seeds, result.fitness, result.successes, result.genomes, result.best.astype("<f4"))
        rows = [
            (block.condition, block.first_run + k, seed, float(fitness), int(successes), genome, best.tobytes())
            for k, (seed, fitness, successes, genome, best) in enumerate(zip(*columns, strict=True))
        ]
        with self._db:
            self._db.execute("BEGIN")
            self._db.executemany("INSERT INTO run VALUES (?, ?, ?, ?, ?, ?, ?)", rows)
            self._db.execute(
                "UPDATE session SET wall_s = ?, runs = runs + ? WHERE id = ?",
                (time.monotonic() - self._started, len(rows), self._session),
            )

    def close(self) -> None:
        """Let others write to the study. May be called twice."""
        super().close()
        self._lock.release()

    def _check_unchanged(self, study: Study) -> None:
        rows = self._db.execute("SELECT identity, config FROM condition ORDER BY number").fetchall()
        if self.seed == study.config.seed and rows == [(_hex(c), c.text) for c in study.conditions]:
            return
        differences = data_difference(self.written, study.written)
        if not differences:
            # as written the two are equal: has a default changed since, or was one merely added?
            pairs = zip(self.conditions(), study.conditions, strict=True)
            differences = next(filter(None, (config_difference(old.config, new.config) for old, new in pairs)), [])
        if not differences:
            return
        lines = "\n".join(f"  {difference}" for difference in differences)
        raise StudyChanged(
            f"{self.directory} holds a study that was begun with another configuration:\n{lines}",
            "Undo the change, or choose another --out for the new study. Only the number of runs may differ.",
        )


def _create(study: Study, directory: Path) -> None:
    directory.mkdir(parents=True, exist_ok=True)
    path = directory / STUDY_NAME
    unfinished = path.with_suffix(".new")
    unfinished.unlink(missing_ok=True)
    db = sqlite3.connect(unfinished, isolation_level=None)
    db.executescript(f"PRAGMA application_id = {APPLICATION_ID}; PRAGMA user_version = {SCHEMA_VERSION}; {SCHEMA}")
    with db:
        db.execute("BEGIN")
        db.execute(
            "INSERT INTO study VALUES (1, ?, ?, ?, ?, ?, ?)",
            (
                study.config.name,
                study.config.about,
                _now(),
                study.config.seed,
                json.dumps(study.written),
                json.dumps(running_versions()),
            ),
        )
        db.executemany(
            "INSERT INTO condition VALUES (?, ?, ?, ?)",
            [(c.number, _hex(c), json.dumps(c.settings), c.text) for c in study.conditions],
        )
    db.close()
    unfinished.replace(path)


def _open(directory: Path, mode: str) -> sqlite3.Connection:
    path = directory / STUDY_NAME
    if not path.is_file():
        what = "holds no study" if directory.is_dir() else "does not exist"
        raise NotARun(f"{directory} {what}.", "Name the folder that `sceann study` printed (its --out).")
    db = sqlite3.connect(f"{path.absolute().as_uri()}?mode={mode}", uri=True, isolation_level=None, timeout=30.0)
    try:
        application = db.execute("PRAGMA application_id").fetchone()[0]
        schema = db.execute("PRAGMA user_version").fetchone()[0]
        if application == APPLICATION_ID and mode == "rw":
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
        raise NotARun(f"{path} is not a study of this program.", "Name the folder that `sceann study` printed.")
    if schema > SCHEMA_VERSION:
        db.close()
        raise RunIsNewer(
            f"{directory} was written by a newer version: its schema is {schema}, this one knows up to "
            f"{SCHEMA_VERSION}.",
            "Update sceann-hil.",
        )
    return db


def _hex(condition: Condition) -> str:
    return f"{condition.identity:016x}"


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")

"""From a checked study to a filled database: what is still to be done, who does it, and what happens on the way."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Protocol

from sceann_hil.errors import ConfigError
from sceann_hil.journal.disk import when_there_is_room
from sceann_hil.study.blocks import Block, BlockResult
from sceann_hil.study.condition import Condition
from sceann_hil.study.config import Study
from sceann_hil.study.store import StudyStore

TRIALS_AT_ONCE = 10_000
"""Trials of one robot call: enough to keep every lane busy, few enough that memory does not matter."""


class Workers(Protocol):
    """Who computes blocks."""

    @property
    def count(self) -> int:
        """How many blocks are computed at the same time."""

    @property
    def description(self) -> str:
        """For reports."""

    def compute(self, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Results in the order in which they are finished."""


class Observer:
    """Told how a study goes on; the base class keeps quiet."""

    def begin(self, todo: Todo) -> None:
        """Before the first block."""

    def finished(self, condition: Condition, result: BlockResult) -> None:
        """A block is in the database."""

    def disk_full(self) -> None:
        """The database cannot grow; the study waits."""


@dataclass(frozen=True, slots=True)
class Todo:
    """What is still to be done of a study.

    Attributes:
        study: the study.
        runs: numbers of the missing runs of each condition, in order.
        trials: what one run of each condition costs at most, in trials.
    """

    study: Study
    runs: tuple[Sequence[int], ...]
    trials: tuple[int, ...] = field(default=())

    @classmethod
    def of(cls, study: Study, store: StudyStore) -> Todo:
        """Everything that the database does not hold yet."""
        wanted = range(study.config.runs)
        # a range where nothing is done yet: ten million numbers one by one would fill the memory
        done = [store.finished(condition.number) for condition in study.conditions]
        missing = [sorted(set(wanted) - finished) if finished else wanted for finished in done]
        return cls(study, tuple(missing), tuple(_trials_of_a_run(c) for c in study.conditions))

    @property
    def n_runs(self) -> int:
        """Missing runs of all conditions."""
        return sum(map(len, self.runs))

    def blocks(self, n_workers: int) -> Iterator[Block]:
        """The missing runs in blocks of consecutive ones. How they are cut has no influence on any number."""
        fair_share = max(1, self.n_runs // (2 * n_workers))
        for condition, runs in zip(self.study.conditions, self.runs, strict=True):
            algorithm, n_trials = condition.config.algorithm, condition.config.build_task().n_trials
            most = min(fair_share, max(1, TRIALS_AT_ONCE // (algorithm.population * n_trials)))
            for chunk in _consecutive(runs, most):
                seeds = condition.seeds(self.study.config.seed, chunk)
                yield Block(condition.number, chunk[0], condition.text, tuple(seeds.tolist()))


def run_study(
    study: Study,
    directory: Path,
    workers: Workers,
    observer: Observer | None = None,
    *,
    accept_other_versions: bool = False,
) -> None:
    """Do what is missing of a study; everything that was done before is kept.

    Args:
        study: checked.
        directory: holds the database, or will.
        workers: who computes.
        observer: told how it goes on.
        accept_other_versions: also on other versions than the session before.

    Raises:
        ConfigError: a condition's robot cannot run many trials at once.
        StudyChanged: the folder holds a study with other conditions.
        OtherVersions: it was begun with other versions.
        RunIsLocked, RunIsNewer, RunIsDamaged, NotARun: the database cannot be used.
        WorkersLost: nobody is left to compute.
    """
    observer = observer or Observer()
    _refuse_physical_robots(study)
    with StudyStore.begin_or_continue(
        study, directory, workers.description, accept_other_versions=accept_other_versions
    ) as store:
        todo = Todo.of(study, store)
        observer.begin(todo)
        for result in workers.compute(todo.blocks(workers.count)):
            when_there_is_room(partial(store.record, result), observer.disk_full)
            observer.finished(study.conditions[result.block.condition], result)


def _refuse_physical_robots(study: Study) -> None:
    for condition in study.conditions:
        spec = condition.config.robot.spec
        if not spec.takes_batches:
            raise ConfigError(
                f"robot.type: a study needs a simulated robot that runs many trials at once; {spec.name} takes "
                f"{spec.batch_size or 'them'} at a time"
                f"{' with a person beside it' if spec.attended else ''} (condition [{condition.label}])",
                "Nothing was started. Use `sceann evolve` for a physical robot.",
            )


def _trials_of_a_run(condition: Condition) -> int:
    algorithm = condition.config.algorithm
    return algorithm.population * (algorithm.generations + 1) * condition.config.build_task().n_trials


def _consecutive(numbers: Sequence[int], most: int) -> Iterator[list[int]]:
    chunk: list[int] = []
    for number in numbers:
        if chunk and (number != chunk[-1] + 1 or len(chunk) == most):
            yield chunk
            chunk = []
        chunk.append(number)
    if chunk:
        yield chunk

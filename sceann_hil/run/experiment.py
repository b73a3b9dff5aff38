"""One run: evolve, stop, resume. State in the journal, nothing but the journal.

A run is a folder::

    DIR/journal.sqlite   the record of truth (`sceann_hil.journal`)
    DIR/config.yaml      the configuration, every default spelled out, for people
    DIR/lock             held while a process works on the run
    DIR/recording/       derived from the journal (`sceann_hil.recording`)
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass, replace
from enum import Enum, auto
from pathlib import Path
from typing import Any, Self

from sceann_hil.config import ExperimentConfig, dump_config, parse_config
from sceann_hil.errors import RunExists
from sceann_hil.evolution import Algorithm, State
from sceann_hil.journal import (
    JOURNAL_NAME,
    LOCK_NAME,
    GenerationRow,
    IndividualRow,
    Journal,
    JournalReader,
    RunLock,
    SpentRow,
)
from sceann_hil.recording import RecordingPaths
from sceann_hil.robot import Robot
from sceann_hil.robot.task import Task
from sceann_hil.run.ancestor import Ancestor
from sceann_hil.run.evaluator import Evaluator
from sceann_hil.seeds import Purpose, generator
from sceann_hil.supervision.budget import Amounts, Meter
from sceann_hil.supervision.companion import Stoppable
from sceann_hil.supervision.drift import ReferenceRuns
from sceann_hil.supervision.forecast import Cost, Forecast
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.stopping import Stopped, StopReason
from sceann_hil.supervision.supervision import RunFacts, Supervisor
from sceann_hil.versions import running_versions

CONFIG_NAME = "config.yaml"


class Outcome(Enum):
    """How `Experiment.evolve` ended."""

    FINISHED = auto()
    STOPPED_AFTER_GENERATION = auto()
    STOPPED_NOW = auto()
    FINISHED_BY_OPERATOR = auto()
    BUDGET_SPENT = auto()


_OUTCOMES = {
    StopReason.ASKED: Outcome.STOPPED_NOW,
    StopReason.OPERATOR: Outcome.FINISHED_BY_OPERATOR,
    StopReason.BUDGET: Outcome.BUDGET_SPENT,
}


class StopRequest(Enum):
    """What somebody wants of a running experiment."""

    NONE = auto()
    AFTER_GENERATION = auto()
    NOW = auto()


@dataclass(frozen=True, slots=True)
class Progress:
    """Told after every generation.

    Attributes:
        generation: the journal's row of the generation that just finished.
        last_generation: number of the run's last generation.
        trials: trials counted in this generation.
        champion: its best individual.
    """

    generation: GenerationRow
    last_generation: int
    trials: int
    champion: IndividualRow


class Experiment:
    """A run that is open for evolution; close it, or use it in a ``with`` block.

    Attributes:
        directory: the run's folder.
        config: what the run does.
        journal: its record.
    """

    def __init__(self, directory: Path, lock: RunLock, journal: Journal) -> None:
        self.directory = directory
        self.journal = journal
        self._lock = lock
        text = journal.reader.run().config
        self.config: ExperimentConfig = parse_config(text, f"{directory}: journalled configuration")
        if not (directory / CONFIG_NAME).exists():
            (directory / CONFIG_NAME).write_text(text, encoding="utf-8")

    @classmethod
    def create(cls, config: ExperimentConfig, directory: Path, ancestor: Ancestor | None = None) -> Self:
        """Start a run in a folder that is new or empty.

        Args:
            config: what it does.
            directory: where.
            ancestor: the run whose population it goes on from, perhaps on another robot.

        Raises:
            RunExists: there is something at `directory`.
            ConfigError: the ancestor's genomes do not fit.
        """
        first = ancestor.first_generation(config) if ancestor is not None else None
        if directory.exists() and not _is_free(directory):
            raise RunExists(
                f"{directory} exists already; nothing was overwritten.",
                "Choose another --out, or `sceann resume` it if it is a run.",
            )
        directory.mkdir(parents=True, exist_ok=True)
        with ExitStack() as undo:
            lock = undo.enter_context(RunLock(directory))
            journal = Journal.create(
                directory,
                name=config.name or directory.name,
                root_seed=config.seed,
                config=dump_config(config),
                versions=running_versions(),
                parent_run=str(ancestor.directory) if ancestor is not None else None,
                first=first,
            )
            undo.callback(journal.close)
            experiment = cls(directory, lock, journal)
            undo.pop_all()
        return experiment

    @classmethod
    def open(cls, directory: Path) -> Self:
        """Go on with a run.

        Raises:
            NotARun, RunIsNewer, RunIsDamaged, RunIsLocked: why not.
        """
        # a folder that is no run gets no lock; and opening an old journal brings it up to date, which takes one
        JournalReader(directory).close()
        with ExitStack() as undo:
            lock = undo.enter_context(RunLock(directory))
            journal = Journal(directory)
            undo.callback(journal.close)
            experiment = cls(directory, lock, journal)
            undo.pop_all()
        return experiment

    def evolve(
        self,
        robot: Robot,
        report: Callable[[Progress], None] = lambda _: None,
        stop: Callable[[], StopRequest] = lambda: StopRequest.NONE,
        desk: Desk | None = None,
        limits: Amounts | None = None,
    ) -> Outcome:
        """Evaluate and breed generation after generation, from wherever the journal stands.

        Args:
            robot: connected; as the configuration says.
            report: called after every generation, for progress displays.
            stop: asked after every generation and before every batch of trials.
            desk: where the operators are; nobody by default.
            limits: budgets over all sessions of the run; by default those of the session before, or, in the first one,
                of the configuration.

        Raises:
            RobotError: the robot's, and `TrialVoid` when a trial keeps failing. The run can be resumed.
        """
        algorithm = self.config.algorithm.build(self.config.genome_length)
        task = self.config.task.build()
        desk = desk or Desk(asks=False, stop=lambda: stop() is StopRequest.NOW)
        supervisor = self._supervisor(robot, task, desk, limits)
        evaluator = Evaluator(
            self.config.phenotype,
            task,
            robot,
            self.config.seed,
            self.journal,
            Stoppable(supervisor, lambda: stop() is StopRequest.NOW),
            self.config.saving,
        )
        begun = self.journal.reader.last_generation() is not None
        self.journal.note("resumed" if begun else "started", f"process {os.getpid()}")
        try:
            for number, state in self._generations(algorithm):
                started = time.monotonic()
                evaluation = evaluator.evaluate(number, algorithm.ask(state))
                self.journal.finish_generation(
                    number, evaluation.fitness, time.monotonic() - started, evaluation.success_rate
                )
                report(self._progress(number, evaluation.fitness.size * task.n_trials))
                if stop() is StopRequest.AFTER_GENERATION and number < self.config.algorithm.generations:
                    self.journal.note("stopped", "after a generation, as asked", number)
                    return Outcome.STOPPED_AFTER_GENERATION
        except Stopped as stopped:
            self.journal.note("stopped", stopped.message)
            desk.close(stopped.message)
            return _OUTCOMES[stopped.reason]
        self.journal.note("finished", "all generations are evaluated")
        desk.close("all generations are evaluated")
        return Outcome.FINISHED

    def forget(self) -> bool:
        """Close a run in which nothing was ever measured, and remove what it put into its folder.

        The folder goes too, unless somebody else keeps something in it, or something is linked or mounted there.

        Returns:
            False if there is something in the run: nothing was done.
        """
        reader = self.journal.reader
        if reader.count_attempts():
            return False
        self.journal.close()
        shutil.rmtree(RecordingPaths(self.directory).folder, ignore_errors=True)
        own = {CONFIG_NAME, LOCK_NAME, *(f"{JOURNAL_NAME}{end}" for end in ("", "-wal", "-shm", ".seal"))}
        for path in list(self.directory.iterdir()):
            if path.name in own or Journal.is_unborn(path):
                path.unlink()
        self.close()
        with suppress(OSError):
            self.directory.rmdir()
        return True

    def close(self) -> None:
        """Let others write to the run. May be called twice."""
        self.journal.close()
        self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def extended(self, more: dict[str, float]) -> Amounts | None:
        """Budgets for a session that may spend so much more; None if nothing is asked for.

        Args:
            more: by names of `Amounts`, on top of what is spent.
        """
        if not more:
            return None
        spent = _amounts(self.journal.reader.spent())
        return replace(self._limits(), **{name: getattr(spent, name) + amount for name, amount in more.items()})

    def _limits(self) -> Amounts:
        """Of the newest session, or of the configuration."""
        known = self.journal.reader.limits()
        if known is None:
            return self.config.budget.limits
        return Amounts(**{name: float("inf") if value is None else value for name, value in known.items()})

    def _supervisor(self, robot: Robot, task: Task, desk: Desk, limits: Amounts | None) -> Supervisor:
        config, reader = self.config, self.journal.reader
        limits = limits or self._limits()
        longest_trial_s = task.max_steps * robot.spec.tick_s
        trials = config.algorithm.population * task.n_trials
        before = [(row[0], Cost(*row[1:])) for row in reader.costs()]
        forecast = Forecast(config.algorithm.generations, trials, longest_trial_s, before)
        spent = reader.spent()
        # trials that are not settled are counted when they are
        meter = Meter(limits, _amounts(spent) - Amounts(trials=spent.unsettled), longest_trial_s)
        reference = ReferenceRuns(config.reference, self.config.phenotype, task, robot, config.seed, self.journal)
        finite = {name: None if value == float("inf") else value for name, value in asdict(limits).items()}
        operators = config.operator.resolved(attended=robot.spec.attended)
        self.journal.begin_session(robot.spec.name, ", ".join(operators) or "none", finite)
        return Supervisor(
            robot,
            self.journal,
            desk,
            meter,
            forecast,
            config.suspenders.build(),
            RunFacts(reader.run().name, task, config.algorithm.generations),
            confirm=config.operator.confirm,
            whole_generations=config.budget.whole_generations,
            reference=reference.run_if_due,
        )

    def _generations(self, algorithm: Algorithm[Any]) -> Iterator[tuple[int, State]]:
        """The generations that are still to be evaluated, each journalled before it is yielded."""
        reader = self.journal.reader
        row = reader.last_generation()
        if row is None:
            number, state = 0, algorithm.start(generator(self.config.seed, Purpose.ALGORITHM, 0))
            self._begin(algorithm, number, state, {})
        else:
            number, state = row.number, algorithm.load(reader.algorithm_state(row.number))
            if row.finished_at is not None and number < self.config.algorithm.generations:
                number, state = self._breed(algorithm, number, state)
            elif row.finished_at is not None:
                return
        while True:
            yield number, state
            if number >= self.config.algorithm.generations:
                return
            number, state = self._breed(algorithm, number, state)

    def _breed(self, algorithm: Algorithm[Any], number: int, state: State) -> tuple[int, State]:
        rows = self.journal.reader.individuals(number)
        fitness = self.journal.reader.fitness(number)
        child = algorithm.tell(state, fitness, generator(self.config.seed, Purpose.ALGORITHM, number + 1))
        self._begin(algorithm, number + 1, child, {row.number: row.id for row in rows})
        return number + 1, child

    def _begin(self, algorithm: Algorithm[Any], number: int, state: State, ids: dict[int, int]) -> None:
        self.journal.begin_generation(
            number,
            algorithm.dump(state),
            state.genomes,
            [ids.get(parent) for parent in state.parents.tolist()],
            algorithm.structures(state),
        )

    def _progress(self, number: int, trials: int) -> Progress:
        reader = self.journal.reader
        row, champion = reader.last_generation(), reader.champion()
        if row is None or champion is None:
            raise RuntimeError(f"generation {number} was finished and is not in the journal")
        return Progress(row, self.config.algorithm.generations, trials, champion)


def _amounts(spent: SpentRow) -> Amounts:
    return Amounts(spent.robot_s, spent.wall_s, float(spent.trials), spent.battery_charges)


def _is_free(directory: Path) -> bool:
    """An empty folder, or what is left of a run that was killed before it began."""
    return directory.is_dir() and all(path.name == LOCK_NAME or Journal.is_unborn(path) for path in directory.iterdir())

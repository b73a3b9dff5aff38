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
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path
from typing import Self

from sceann_hil.config import ExperimentConfig, dump_config, journalled_config
from sceann_hil.errors import RunExists
from sceann_hil.journal import (
    JOURNAL_NAME,
    LOCK_NAME,
    GenerationRow,
    IndividualRow,
    Journal,
    RunLock,
)
from sceann_hil.journal.reader import journal_path
from sceann_hil.journal.salvage import return_to_generation
from sceann_hil.places import make_folder
from sceann_hil.robot import Robot, RobotError
from sceann_hil.run.ancestor import Ancestor
from sceann_hil.run.breeding import generations
from sceann_hil.run.champion import champion_of
from sceann_hil.run.evaluator import Evaluator
from sceann_hil.run.measures import Measures
from sceann_hil.run.reference import ReferenceRuns
from sceann_hil.run.same_robot import check_same_robot
from sceann_hil.run.session import Presence, begin_session
from sceann_hil.supervision.forecast import Cost, Forecast
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.stopping import Stopped, StopReason, StopRequest, nobody
from sceann_hil.versions import running_versions

CONFIG_NAME = "config.yaml"
RECORDING_NAME = "recording"


class Outcome(Enum):
    """How `Experiment.evolve` ended."""

    FINISHED = auto()
    STOPPED_AFTER_GENERATION = auto()
    STOPPED_NOW = auto()
    FINISHED_BY_OPERATOR = auto()
    BUDGET_SPENT = auto()
    TERMINATED = auto()
    HUNG_UP = auto()


_OUTCOMES = {
    StopReason.ASKED: Outcome.STOPPED_NOW,
    StopReason.OPERATOR: Outcome.FINISHED_BY_OPERATOR,
    StopReason.BUDGET: Outcome.BUDGET_SPENT,
    StopReason.TERMINATED: Outcome.TERMINATED,
    StopReason.HUNG_UP: Outcome.HUNG_UP,
}


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
        self.config: ExperimentConfig = journalled_config(journal.reader)
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
        make_folder(directory)
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
                robot=config.robot.spec,
            )
            undo.callback(journal.close)
            experiment = cls(directory, lock, journal)
            undo.pop_all()
        return experiment

    @classmethod
    def open(cls, directory: Path, *, accept_other_versions: bool = False, from_generation: int | None = None) -> Self:
        """Go on with a run.

        Args:
            directory: its folder.
            accept_other_versions: also on other versions, or with another simulated body, than the session before.
            from_generation: forget what comes after this generation, damaged or not; the journal of before is kept.

        Raises:
            NotARun, RunIsNewer, RunIsDamaged, RunIsLocked: why not.
        """
        journal_path(directory)  # a folder that is no run gets no lock
        with ExitStack() as undo:
            lock = undo.enter_context(RunLock(directory))
            if from_generation is not None:
                _forget_recording(directory / RECORDING_NAME)
                return_to_generation(directory, from_generation)
            journal = Journal(directory)
            journal.accept_other_versions = accept_other_versions
            undo.callback(journal.close)
            experiment = cls(directory, lock, journal)
            undo.pop_all()
        return experiment

    def evolve(
        self,
        robot: Robot,
        report: Callable[[Progress], None] = lambda _: None,
        stop: Callable[[], StopRequest] = nobody,
        desk: Desk | None = None,
        more: dict[str, float] | None = None,
    ) -> Outcome:
        """Evaluate and breed generation after generation, from wherever the journal stands.

        Args:
            robot: connected; as the configuration says.
            report: called after every generation, for progress displays.
            stop: asked after every generation and before every batch of trials.
            desk: where the operators are; nobody by default.
            more: what this session may spend, see `sceann_hil.run.session.Presence`.

        Raises:
            RobotError: the robot's, and `TrialVoid` when a trial keeps failing. The run can be resumed.
        """
        config, reader, last = self.config, self.journal.reader, self.config.algorithm.generations
        algorithm = config.algorithm.for_experiment(config)
        presence = Presence(desk or Desk(asks=False, stop=stop), stop, more or {})
        runner = begin_session(self.journal, config, robot, self._forecast(robot), presence)
        runner.before = ReferenceRuns(config.reference, runner, config.seed).run_if_due
        evaluator = Evaluator(runner, config.seed, config.saving)
        begun = any(kind == "started" for _, _, kind, _ in reader.events())
        self.journal.note("resumed" if begun else "started", f"process {os.getpid()}")
        try:
            if config.algorithm.weighs_trials:
                check_same_robot(self.journal, robot, presence.desk or Desk(asks=False, stop=stop))
            for number, state in generations(self.journal, algorithm, config.seed, last, Measures.of(config)):
                started = time.monotonic()
                of = algorithm.wanted(state, runner.task.n_trials)
                evaluation = evaluator.evaluate(number, algorithm.ask(state), of, algorithm.remark(state))
                self.journal.finish_generation(
                    number, evaluation.fitness, time.monotonic() - started, evaluation.success_rate
                )
                n_trials = evaluation.fitness.size * runner.task.n_trials if of is None else int(of.sum())
                report(self._progress(number, n_trials))
                if number == last or algorithm.is_last(state):
                    break
                request = stop()
                if request is StopRequest.AFTER_GENERATION:
                    why = f"Stopped after generation {number}, as you asked"
                    return self._ended(presence, Outcome.STOPPED_AFTER_GENERATION, why)
                if (stopped := request.at_once) is not None:
                    raise stopped
        except Stopped as stopped:
            return self._ended(presence, _OUTCOMES[stopped.reason], stopped.message)
        except RobotError as error:
            self.journal.note("stopped", str(error))
            raise
        return self._ended(presence, Outcome.FINISHED, "All generations are evaluated")

    def _ended(self, presence: Presence, outcome: Outcome, why: str) -> Outcome:
        self.journal.note("finished" if outcome is Outcome.FINISHED else "stopped", why)
        if presence.desk is not None:
            presence.desk.close(why)
        return outcome

    def _forecast(self, robot: Robot) -> Forecast:
        config, task = self.config, self.config.build_task()
        before = [(row[0], Cost(*row[1:])) for row in self.journal.reader.costs()]
        trials = config.algorithm.population * task.n_trials
        return Forecast(config.algorithm.generations, trials, task.max_steps * robot.spec.tick_s, before)

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
        shutil.rmtree(self.directory / RECORDING_NAME, ignore_errors=True)
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

    def _progress(self, number: int, trials: int) -> Progress:
        reader = self.journal.reader
        row, champion = reader.last_generation(), champion_of(reader, keeps_best=self.config.algorithm.keeps_best)
        if row is None or champion is None:
            raise RuntimeError(f"generation {number} was finished and is not in the journal")
        return Progress(row, self.config.algorithm.generations, trials, champion)


def _forget_recording(folder: Path) -> None:
    """Remove what was drawn of the run.

    Raises:
        RunIsLocked: a recorder is still at work; it would draw what is about to be forgotten.
    """
    if folder.is_dir():
        with RunLock(folder):
            shutil.rmtree(folder, ignore_errors=True)


def _is_free(directory: Path) -> bool:
    """An empty folder, or what is left of a run that was killed before it began."""
    return directory.is_dir() and all(path.name == LOCK_NAME or Journal.is_unborn(path) for path in directory.iterdir())

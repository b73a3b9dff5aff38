"""Genomes to trials to robot to results to fitness: the only place where they meet.

The evaluator works for every robot alike. It reads the robot's spec for how many trials it takes at once, writes each
intent to the journal before the robot moves and each result before the next trial starts, and attempts a void trial
again within a limit. What the journal already holds is never run a second time.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.coding import Bits, Coding, NetworkSize
from sceann_hil.controller import Dynamics
from sceann_hil.journal import AttemptRow, Journal, Slots, trial_arrays
from sceann_hil.robot import EmergencyStop, EndReason, Results, Robot, RobotFault, Trials, TrialVoid
from sceann_hil.seeds import Purpose, keys
from sceann_hil.task import Task

RETRY_LIMIT = 3
"""Attempts of one trial after its first that may be void before the run pauses."""


class Stopped(Exception):
    """The evaluation was asked to stop; everything that was measured is in the journal."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What one generation achieved.

    Attributes:
        fitness: mean over each individual's trials, float64, shape ``(population,)``.
        success_rate: part of all trials that reached what the task asks for.
    """

    fitness: NDArray[np.float64]
    success_rate: float


@dataclass(frozen=True, slots=True)
class Phenotype:
    """How a genome becomes a controller."""

    coding: Coding
    size: NetworkSize
    dynamics: Dynamics


class Evaluator:
    """Evaluates generations on one robot.

    Args:
        phenotype: how a genome becomes a controller.
        task: what a trial is and what it is worth.
        robot: connected.
        root_seed: of the run's seed tree.
        journal: where intents and results go.
        stop: asked before every batch; True ends the evaluation with `Stopped`.
    """

    def __init__(
        self,
        phenotype: Phenotype,
        task: Task,
        robot: Robot,
        root_seed: int,
        journal: Journal,
        stop: Callable[[], bool] = lambda: False,
    ) -> None:
        self._phenotype = phenotype
        self._task = task
        self._robot = robot
        run = journal.reader.run()
        self._run_id = zlib.crc32(f"{run.created_at} {run.root_seed} {run.name}".encode())
        self._root_seed = root_seed
        self._journal = journal
        self._stop = stop

    def evaluate(self, generation: int, genomes: Bits) -> Evaluation:
        """Every trial of every individual, counted exactly once.

        Args:
            generation: number of the generation, whose individuals are in the journal.
            genomes: bits, shape ``(population, L)``.

        Raises:
            Stopped: `stop` said so.
            TrialVoid: a trial was void more often than `RETRY_LIMIT` allows.
            RobotError: the robot's.
        """
        population, n_trials = len(genomes), self._task.n_trials
        weights = self._phenotype.coding.decode(genomes, self._phenotype.size)
        fitness = np.full((population, n_trials), np.nan)
        succeeded = np.zeros((population, n_trials), np.bool_)
        # the last attempt of each trial that the journal knows, by place
        known = {(row.individual, row.trial): row for row in self._journal.reader.attempts(generation)}
        for place, row in known.items():
            if row.fitness is not None:
                fitness[place] = row.fitness
                succeeded[place] = self._task.succeeded(_result_of(row))[0]
        self._settle_unfinished(generation, weights, list(known.values()), fitness, succeeded)
        attempt = np.zeros((population, n_trials), np.int64)
        for place, row in known.items():
            if np.isnan(fitness[place]):
                attempt[place] = row.attempt + 1
        earlier = attempt.copy()
        while np.isnan(fitness).any():
            individual, trial = np.nonzero(np.isnan(fitness))
            slots = Slots(individual, trial, attempt[individual, trial])
            self._check_retries(slots, earlier[individual, trial])
            for part in _batches(len(slots), self._robot.spec.batch_size):
                some = slots.take(part)
                starts = self._task.starts[some.trial]
                noise = keys(self._root_seed, Purpose.TRIAL, generation, some.individual, some.trial, some.attempt)
                self._raise_if_stopped()
                ids = self._journal.intend(generation, some, starts, noise)
                results = self._robot.run(self._trials(weights, some.individual, starts, noise, ids))
                self._count(ids, some, results, fitness, succeeded)
                attempt[some.individual, some.trial] += 1
        return Evaluation(fitness.mean(axis=1), float(succeeded.mean()))

    def _settle_unfinished(
        self,
        generation: int,
        weights: NDArray[np.int8],
        rows: list[AttemptRow],
        fitness: NDArray[np.float64],
        succeeded: NDArray[np.bool_],
    ) -> None:
        """Intents without a result are all that a killed process leaves behind."""
        open_rows = sorted((row for row in rows if row.end_reason is None), key=lambda row: row.id)
        if not open_rows:
            return
        starts, noise, ids = trial_arrays(open_rows)
        slots = Slots(
            np.array([row.individual for row in open_rows]),
            np.array([row.trial for row in open_rows]),
            np.array([row.attempt for row in open_rows]),
        )
        for part in _batches(len(slots), self._robot.spec.batch_size):
            self._raise_if_stopped()
            some = slots.take(part)
            trials = self._trials(weights, some.individual, starts[part], noise[part], ids[part])
            settled = self._robot.settle(trials)
            self._count(ids[part], some, settled, fitness, succeeded)

    def _count(
        self,
        ids: NDArray[np.int64],
        slots: Slots,
        results: Results,
        fitness: NDArray[np.float64],
        succeeded: NDArray[np.bool_],
    ) -> None:
        values = self._task.fitness(results)
        self._journal.record(ids, results, values)
        counts = np.array([not EndReason(reason).is_void for reason in results.end_reasons], np.bool_)
        individual, trial = slots.individual[counts], slots.trial[counts]
        fitness[individual, trial] = values[counts]
        succeeded[individual, trial] = self._task.succeeded(results)[counts]
        if EndReason.EMERGENCY_STOP in results.end_reasons:
            raise EmergencyStop(self._with_complaints("an emergency stop ended the trial; its attempt is void"))
        if EndReason.FAULT in results.end_reasons:
            raise RobotFault(self._with_complaints("the trial ended with a fault; its attempt is void"))

    def _with_complaints(self, what: str) -> str:
        return ": ".join((what, *self._robot.health().messages))

    def _trials(
        self,
        weights: NDArray[np.int8],
        individual: NDArray[np.int64],
        starts: NDArray[np.float64],
        noise: NDArray[np.uint64],
        ids: NDArray[np.int64],
    ) -> Trials:
        return Trials(
            size=self._phenotype.size,
            dynamics=self._phenotype.dynamics,
            weights=weights,
            genome_index=individual.astype(np.int32),
            starts=starts,
            keys=noise,
            max_steps=self._task.max_steps,
            ids=ids,
            run_id=self._run_id,
        )

    def _check_retries(self, slots: Slots, earlier: NDArray[np.int64]) -> None:
        """Attempts of an earlier process do not count: somebody looked and resumed."""
        worst = int(np.argmax(slots.attempt - earlier))
        if slots.attempt[worst] - earlier[worst] > RETRY_LIMIT:
            raise TrialVoid(
                f"trial {slots.trial[worst]} of individual {slots.individual[worst]} was void "
                f"{slots.attempt[worst]} times; " + self._with_complaints("no fitness was made of it")
            )

    def _raise_if_stopped(self) -> None:
        if self._stop():
            raise Stopped


def _batches(n: int, batch_size: int | None) -> list[slice]:
    step = batch_size or max(n, 1)
    return [slice(first, min(first + step, n)) for first in range(0, n, step)]


def _result_of(row: AttemptRow) -> Results:
    return Results(
        end_reasons=np.array([row.end_reason], np.uint8),
        steps=np.array([row.steps], np.int32),
        hashes=np.array([row.state_hash], np.uint16),
        final_states=np.array([row.final_state], np.float32),
        durations_s=np.array([row.robot_s], np.float64),
    )

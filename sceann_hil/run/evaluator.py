"""Genomes to trials to robot to results to fitness: the only place where they meet.

The evaluator works for every robot alike. It reads the robot's spec for how many trials it takes at once, writes each
intent to the journal before the robot moves and each result before the next trial starts, and attempts a void trial
again within a limit. What the journal already holds is never run a second time. Whoever has a say between trials
(operator, budget, suspenders) has it as the evaluator's `Companion`.
"""

from __future__ import annotations

import copy
import zlib
from collections import deque
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from sceann_hil.journal import AttemptRow, Journal, Slots, trial_arrays
from sceann_hil.network.coding import Bits, genome_to_hex
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import EmergencyStop, EndReason, Results, Robot, RobotFault, TrialVoid
from sceann_hil.robot.task import Task
from sceann_hil.seeds import Purpose, keys
from sceann_hil.supervision.companion import Alone, Attended, Companion
from sceann_hil.supervision.saving import Pool, Racing, SavingConfig, raced_fitness, rounds, still_open

RETRY_LIMIT = 3
"""Attempts of one trial after its first that may be void, not counting an operator's, before the run pauses."""


@dataclass(frozen=True, slots=True)
class Evaluation:
    """What one generation achieved.

    Attributes:
        fitness: mean over each individual's trials, float64, shape ``(population,)``;
            `sceann_hil.supervision.saving` says what it is where trials were saved.
        success_rate: part of its trials that reached what the task asks for.
    """

    fitness: NDArray[np.float64]
    success_rate: float


@dataclass(slots=True)
class _Generation:
    """A generation while it is evaluated (p individuals, t trials)."""

    number: int
    genomes: Bits
    weights: NDArray[np.int8]
    fitness: NDArray[np.float64]
    """Counted fitness by place, NaN where there is none yet."""
    succeeded: NDArray[np.bool_]
    attempts: NDArray[np.int64]
    """Attempts that came to nothing, so the number of the next one."""
    failures: NDArray[np.int64]
    """Of these, the ones in this session that no operator wanted: after earlier ones somebody looked and resumed."""
    pool: Pool | None


class Evaluator:
    """Evaluates generations on one robot.

    Args:
        phenotype: how a genome becomes a controller.
        task: what a trial is and what it is worth.
        robot: connected.
        root_seed: of the run's seed tree.
        journal: where intents and results go.
        companion: who has a say between trials.
        saving: how robot time is saved.
    """

    def __init__(
        self,
        phenotype: Phenotype,
        task: Task,
        robot: Robot,
        root_seed: int,
        journal: Journal,
        companion: Companion | None = None,
        saving: SavingConfig | None = None,
    ) -> None:
        self._phenotype = phenotype
        self._task = task
        self._robot = robot
        run = journal.reader.run()
        self._run_id = zlib.crc32(f"{run.created_at} {run.root_seed} {run.name}".encode())
        self._root_seed = root_seed
        self._journal = journal
        self._companion = companion or Alone()
        self._saving = saving or SavingConfig()

    def evaluate(self, generation: int, genomes: Bits) -> Evaluation:
        """Every trial of every individual, counted exactly once.

        Args:
            generation: number of the generation, whose individuals are in the journal.
            genomes: bits, shape ``(population, L)``.

        Raises:
            Stopped: somebody wants the run to end.
            TrialVoid: a trial was void more often than `RETRY_LIMIT` allows.
            RobotError: the robot's.
        """
        population, n_trials = len(genomes), self._task.n_trials
        now = _Generation(
            number=generation,
            genomes=genomes,
            weights=self._phenotype.decode(genomes),
            fitness=np.full((population, n_trials), np.nan),
            succeeded=np.zeros((population, n_trials), np.bool_),
            attempts=np.zeros((population, n_trials), np.int64),
            failures=np.zeros((population, n_trials), np.int64),
            pool=self._pool(generation, genomes),
        )
        wanted = np.ones((population, n_trials), np.bool_) if now.pool is None else now.pool.wanted(genomes)
        self._recall(now)
        is_open = np.ones(population, np.bool_)
        self._companion.begin(generation, int((wanted & np.isnan(now.fitness)).sum()), population * n_trials)
        racing = self._saving.racing is not Racing.OFF
        order = rounds(
            population,
            n_trials,
            trial_by_trial=racing,
            shuffle=self._saving.shuffle,
            root_seed=self._root_seed,
            generation=generation,
        )
        for number, places in enumerate(order):
            run = wanted[places[:, 0], places[:, 1]] & is_open[places[:, 0]]
            self._run_all(now, places[run])
            if racing:
                is_open &= still_open(
                    self._values(now, number + 1),
                    self._task.worst_fitness,
                    self._task.best_fitness,
                    self._saving.racing,
                )
        return self._evaluation(now, racing)

    def _evaluation(self, now: _Generation, racing: bool) -> Evaluation:
        counted = ~np.isnan(now.fitness)
        success_rate = float(now.succeeded.mean()) if counted.all() else _mean(now.succeeded[counted])
        if now.pool is not None:
            success_rate = float(np.nanmean(_pooled(now, now.pool)[1]))
        values = self._values(now, self._task.n_trials)
        if racing:
            task = self._task
            fitness = raced_fitness(values, task.worst_fitness, task.best_fitness, self._saving.racing)
            return Evaluation(fitness, success_rate)
        return Evaluation(values.mean(axis=1), success_rate)

    def _values(self, now: _Generation, rounds_done: int) -> NDArray[np.float64]:
        """Fitness by place as far as a race that has done so many rounds may know it, shape ``(p, t)``."""
        values = now.fitness if now.pool is None else _pooled(now, now.pool)[0]
        values = values.copy()
        values[:, rounds_done:] = np.nan
        return values

    # -- pooling ----------------------------------------------------------------------------------------------------

    def _pool(self, generation: int, genomes: Bits) -> Pool | None:
        """What the run knows of this generation's genomes from generations before."""
        noise_free = self._robot.spec.noise_free
        limit = self._saving.evaluations(noise_free=noise_free)
        if limit is None:
            return None
        pool = Pool(self._task.n_trials, limit, noisy=not noise_free)
        for genome in {genome.tobytes(): genome for genome in genomes}.values():
            for row in self._journal.reader.attempts_of_genome(genome_to_hex(genome), generation):
                if row.fitness is not None:
                    succeeded = bool(self._task.succeeded(_result_of(row))[0])
                    pool.add(genome.tobytes(), row.trial, row.fitness, succeeded)
        return pool

    # -- running ----------------------------------------------------------------------------------------------------

    def _recall(self, now: _Generation) -> None:
        """What the journal knows of this generation; intents without a result are all that a killed process leaves."""
        newest: dict[tuple[int, int], AttemptRow] = {}
        for row in self._journal.reader.attempts(now.number):
            place = (row.individual, row.trial)
            newest[place] = row
            now.attempts[place] = row.attempt + 1
            if row.fitness is not None:
                now.fitness[place] = row.fitness
                now.succeeded[place] = self._task.succeeded(_result_of(row))[0]
        open_rows = sorted((row for row in newest.values() if row.end_reason is None), key=lambda row: row.id)
        if not open_rows:
            return
        starts, noise, ids = trial_arrays(open_rows)
        slots = Slots(
            np.array([row.individual for row in open_rows]),
            np.array([row.trial for row in open_rows]),
            np.array([row.attempt for row in open_rows]),
        )
        for part in _batches(len(slots), self._robot.spec.batch_size):
            some = slots.take(part)
            trials = self._task.trials(
                self._phenotype,
                now.weights,
                some.individual,
                some.trial,
                noise[part],
                ids[part],
                starts=starts[part],
                run_id=self._run_id,
            )
            attended = self._companion.attend(now.number, some, trials, self._robot.settle, self._task)
            self._count(now, ids[part], some, attended)

    def _run_all(self, now: _Generation, places: NDArray[np.int64]) -> None:
        """Run trials until each has a result that counts."""
        queue = deque((int(i), int(t)) for i, t in places if np.isnan(now.fitness[i, t]))
        batch_size = self._robot.spec.batch_size
        while queue:
            size = self._companion.room(min(batch_size or len(queue), len(queue)))
            batch = [queue.popleft() for _ in range(size)]
            individual, trial = (np.array(column, np.int64) for column in zip(*batch, strict=True))
            slots = Slots(individual, trial, now.attempts[individual, trial])
            self._check_retries(now, slots)
            if not self._companion.ready(now.number, slots):
                queue.extend(batch)
                continue
            noise = keys(self._root_seed, Purpose.TRIAL, now.number, slots.individual, slots.trial, slots.attempt)
            planned = self._task.trials(
                self._phenotype, now.weights, slots.individual, slots.trial, noise, run_id=self._run_id
            )
            ids = self._journal.intend(now.number, slots, planned.starts, planned.keys)
            trials = replace(planned, ids=ids)
            attended = self._companion.attend(now.number, slots, trials, self._robot.run, self._task)
            now.attempts[individual, trial] += 1
            self._count(now, ids, slots, attended)
            void = [place for place in batch if np.isnan(now.fitness[place])]
            if attended.at_once:
                queue.extendleft(reversed(void))
            else:
                queue.extend(void)

    def _count(self, now: _Generation, ids: NDArray[np.int64], slots: Slots, attended: Attended) -> None:
        results = attended.results
        values = self._task.fitness(results)
        self._journal.record(ids, results, values, attended.circumstances)
        counts = results.counts
        individual, trial = slots.individual[counts], slots.trial[counts]
        now.fitness[individual, trial] = values[counts]
        now.succeeded[individual, trial] = self._task.succeeded(results)[counts]
        failed = ~counts & (results.end_reasons != EndReason.OPERATOR)
        now.failures[slots.individual[failed], slots.trial[failed]] += 1
        if attended.then is not None:
            raise attended.then
        if EndReason.EMERGENCY_STOP in results.end_reasons:
            raise EmergencyStop(self._with_complaints("an emergency stop ended the trial; its attempt is void"))
        if EndReason.FAULT in results.end_reasons:
            raise RobotFault(self._with_complaints("the trial ended with a fault; its attempt is void"))

    def _with_complaints(self, what: str) -> str:
        return ": ".join((what, *self._robot.health().messages))

    def _check_retries(self, now: _Generation, slots: Slots) -> None:
        failures = now.failures[slots.individual, slots.trial]
        worst = int(np.argmax(failures))
        if failures[worst] > RETRY_LIMIT:
            raise TrialVoid(
                f"trial {slots.trial[worst]} of individual {slots.individual[worst]} was void "
                f"{failures[worst]} times; " + self._with_complaints("no fitness was made of it")
            )


def _pooled(now: _Generation, before: Pool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Fitness and success rate by place, pooled over generations `before` and what is counted of this one."""
    pool = copy.deepcopy(before)
    for individual, trial in zip(*np.nonzero(~np.isnan(now.fitness)), strict=True):
        value, succeeded = float(now.fitness[individual, trial]), bool(now.succeeded[individual, trial])
        pool.add(now.genomes[individual].tobytes(), int(trial), value, succeeded)
    return pool.means(now.genomes)


def _mean(values: NDArray[np.bool_]) -> float:
    return float(values.mean()) if values.size else 0.0


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

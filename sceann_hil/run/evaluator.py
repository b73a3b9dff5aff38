"""What a generation's trials say of its individuals: pooling, racing, the order of trials, and the means.

The trials themselves are run by `sceann_hil.run.trial_runner`, which counts each of them exactly once.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Bits, genome_to_hex
from sceann_hil.run.trial_runner import Places, TrialRunner, TrialSet, result_of
from sceann_hil.seeds import Purpose, keys
from sceann_hil.supervision.saving import Pool, Racing, SavingConfig, raced_fitness, rounds, still_open


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


class Evaluator:
    """Evaluates generations with a `TrialRunner`.

    Args:
        runner: runs the trials.
        root_seed: of the run's seed tree.
        saving: how robot time is saved.
    """

    def __init__(self, runner: TrialRunner, root_seed: int, saving: SavingConfig | None = None) -> None:
        self._runner = runner
        self._task = runner.task
        self._root_seed = root_seed
        self._saving = saving or SavingConfig()

    def evaluate(
        self, generation: int, genomes: Bits, of: NDArray[np.bool_] | None = None, remark: str = ""
    ) -> Evaluation:
        """Every trial of every individual, counted exactly once.

        Args:
            generation: number of the generation, whose individuals are in the journal.
            genomes: bits, shape ``(population, L)``.
            of: the trials that there are, shape ``(population, n_trials)``, at least one of each; all by default.
            remark: what people should know of this generation.

        Raises:
            Stopped, TrialVoid, RobotError: as in `TrialRunner.run`.
        """
        population, n_trials = len(genomes), self._task.n_trials
        pool = self._pool(generation, genomes)
        wanted = np.ones((population, n_trials), np.bool_) if pool is None else pool.wanted(genomes)
        wanted &= True if of is None else of
        trials = self._trials(generation, genomes)
        trials.remark = remark
        rows = self._runner.journal.reader.attempts(generation)
        self._runner.recall(trials, ((row.individual * n_trials + row.trial, row) for row in rows))
        now = _Generation(genomes, trials, n_trials, pool)
        is_open = np.ones(population, np.bool_)
        todo = int((wanted & np.isnan(now.fitness)).sum())
        self._runner.companion.begin(generation, todo, int(wanted.sum()) if of is not None else wanted.size)
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
            self._runner.run(trials, places[run] @ np.array([n_trials, 1]))
            if racing:
                is_open &= still_open(
                    now.values(number + 1), self._task.worst_fitness, self._task.best_fitness, self._saving.racing
                )
        return self._evaluation(now, racing=racing)

    def _evaluation(self, now: _Generation, *, racing: bool) -> Evaluation:
        values, task = now.values(self._task.n_trials), self._task
        if racing:
            fitness = raced_fitness(values, task.worst_fitness, task.best_fitness, self._saving.racing)
            return Evaluation(fitness, now.success_rate)
        # the same bits as ever where every trial counts
        known = ~np.isnan(values)
        fitness = values.mean(axis=1) if known.all() else np.nanmean(values, axis=1)
        return Evaluation(fitness, now.success_rate)

    def _trials(self, generation: int, genomes: Bits) -> TrialSet:
        individual, trial = np.indices((len(genomes), self._task.n_trials), np.int64).reshape(2, -1)

        def noise(places: Places, attempts: NDArray[np.int64]) -> NDArray[np.uint64]:
            return keys(self._root_seed, Purpose.TRIAL, generation, individual[places], trial[places], attempts)

        return TrialSet(self._runner.phenotype.decode(genomes), individual, trial, noise, generation)

    def _pool(self, generation: int, genomes: Bits) -> Pool | None:
        """What the run knows of this generation's genomes from generations before."""
        noise_free = self._runner.robot.spec.noise_free and not self._task.draws_starts
        limit = self._saving.evaluations(noise_free=noise_free)
        if limit is None:
            return None
        pool = Pool(self._task.n_trials, limit, noisy=not noise_free)
        reader = self._runner.journal.reader
        for genome in {genome.tobytes(): genome for genome in genomes}.values():
            for row in reader.attempts_of_genome(genome_to_hex(genome), generation):
                if row.fitness is not None:
                    succeeded = bool(self._task.succeeded(result_of(row))[0])
                    pool.add(genome.tobytes(), row.trial, row.fitness, succeeded)
        return pool


@dataclass(frozen=True, slots=True)
class _Generation:
    """A generation while it is evaluated (p individuals, t trials).

    Attributes:
        genomes: bits, shape ``(p, L)``.
        trials: all of them, individual by individual.
        n_trials: t.
        pool: what is known of the genomes from generations before, if that is used.
    """

    genomes: Bits
    trials: TrialSet
    n_trials: int
    pool: Pool | None

    @property
    def fitness(self) -> NDArray[np.float64]:
        """Counted fitness, NaN where there is none yet, shape ``(p, t)``."""
        return self.trials.fitness.reshape(-1, self.n_trials)

    def values(self, rounds_done: int) -> NDArray[np.float64]:
        """Fitness as far as a race that has done so many rounds may know it, shape ``(p, t)``."""
        values = self.fitness.copy() if self.pool is None else self._pooled(self.pool)[0]
        values[:, rounds_done:] = np.nan
        return values

    @property
    def success_rate(self) -> float:
        """Part of the trials that are known which reached what the task asks for."""
        if self.pool is not None:
            return float(np.nanmean(self._pooled(self.pool)[1]))
        succeeded = self.trials.succeeded[~np.isnan(self.trials.fitness)]
        return float(succeeded.mean()) if succeeded.size else 0.0

    def _pooled(self, before: Pool) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Fitness and success rate, pooled over generations `before` and what counts of this one."""
        pool, trials = copy.deepcopy(before), self.trials
        for place in np.flatnonzero(~np.isnan(trials.fitness)).tolist():
            genome = self.genomes[trials.genome[place]].tobytes()
            pool.add(genome, int(trials.trial[place]), float(trials.fitness[place]), bool(trials.succeeded[place]))
        return pool.means(self.genomes)

"""Many trials in simulation, with no person and no journal: the batch evaluator.

Studies, landscapes, robustness and reports all compute through it, so a void trial becomes a number nowhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sceann_hil.config import ExperimentConfig
from sceann_hil.network.coding import Bits
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import Results, Robot, TrialVoid
from sceann_hil.robot.task import Task
from sceann_hil.run.measures import Measures

TRIALS_AT_ONCE = 1 << 18
"""Trials of one robot call: enough for every core, few enough that memory does not matter."""


@dataclass(frozen=True, slots=True)
class Outcomes:
    """What g genomes did in t trials each; every trial counts.

    Attributes:
        fitness: of every trial, float64, shape ``(g, t)``.
        succeeded: it reached what the task asks for, bool, shape ``(g, t)``.
        durations_s: robot time of every trial, float64, shape ``(g, t)``.
        measures: what the algorithm is told besides, float64, shape ``(g, t, k)``; None if it wants nothing.
    """

    fitness: NDArray[np.float64]
    succeeded: NDArray[np.bool_]
    durations_s: NDArray[np.float64]
    measures: NDArray[np.float64] | None = None

    @property
    def mean_fitness(self) -> NDArray[np.float64]:
        """Of each genome, over its trials, shape ``(g,)``."""
        return np.asarray(self.fitness.mean(axis=1), np.float64)

    @property
    def successes(self) -> NDArray[np.int64]:
        """Of each genome, shape ``(g,)``."""
        return np.asarray(self.succeeded.sum(axis=1), np.int64)


class BatchEvaluator:
    """Evaluates genomes on a robot that takes any number of trials at once. May be used by several threads.

    Args:
        phenotype: how a genome becomes a controller.
        task: what a trial is and what it is worth.
        robot: connected.
        measures: what an algorithm is told besides fitness.

    Raises:
        ValueError: the robot takes trials one by one, or wants a person beside it.
    """

    def __init__(self, phenotype: Phenotype, task: Task, robot: Robot, measures: Measures | None = None) -> None:
        if not robot.spec.takes_batches:
            raise ValueError(f"robot: expected one that runs any number of trials at once, got {robot.spec.name}")
        self.phenotype = phenotype
        self.task = task
        self.robot = robot
        self.measures = measures

    @classmethod
    def of(cls, config: ExperimentConfig, robot: Robot) -> Self:
        """For an experiment; the robot is what its configuration builds."""
        return cls(config.phenotype, config.build_task(), robot, Measures.of(config))

    def evaluate(self, genomes: Bits, noise: ArrayLike = 0, trial: NDArray[np.int64] | None = None) -> Outcomes:
        """Run all trials of some genomes.

        Args:
            genomes: bits, shape ``(g, L)``.
            noise: 64-bit keys from the seed tree, broadcast to shape ``(g, t)``.
            trial: which of the task's trials each of the t trials is, shape ``(t,)``; all of them once if nobody says.

        Raises:
            TrialVoid: a trial ended without a result, or its fitness is no number; nothing is returned for the others
                either.
        """
        trial = np.arange(self.task.n_trials) if trial is None else trial
        shape = (len(genomes), len(trial))
        keys = np.broadcast_to(np.asarray(noise, np.uint64), shape)
        fitness, succeeded, durations_s = np.empty(shape), np.empty(shape, np.bool_), np.empty(shape)
        measures = None if self.measures is None else np.empty((*shape, len(self.measures.columns)))
        step = max(1, TRIALS_AT_ONCE // max(1, len(trial)))
        for first in range(0, len(genomes), step):
            part = slice(first, first + step)
            weights = self.phenotype.decode(genomes[part])
            individual = np.arange(len(weights))[:, None]
            trials = self.task.trials(self.phenotype, weights, individual, trial, keys[part])
            results = trials.completed(self.robot.run(trials))
            results.must_count()
            fitness[part] = _finite(self.task.fitness(results)).reshape(-1, len(trial))
            succeeded[part] = self.task.succeeded(results).reshape(-1, len(trial))
            durations_s[part] = results.durations_s.reshape(-1, len(trial))
            if measures is not None and self.measures is not None:
                measures[part] = self.measures.of_trials(results).reshape(-1, len(trial), measures.shape[2])
        return Outcomes(fitness, succeeded, durations_s, measures)

    def trace(self, genomes: Bits, noise: ArrayLike = 0, trial: NDArray[np.int64] | None = None) -> Results:
        """Run all trials of a few genomes and keep every step of them, in the order of genomes, then trials.

        Args:
            genomes: bits, shape ``(g, L)``.
            noise: keys, broadcast to shape ``(g, t)``.
            trial: as for `evaluate`.

        Raises:
            TrialVoid: a trial ended without a result.
        """
        trial = np.arange(self.task.n_trials) if trial is None else trial
        weights = self.phenotype.decode(genomes)
        keys = np.broadcast_to(np.asarray(noise, np.uint64), (len(genomes), len(trial)))
        individual = np.arange(len(genomes))[:, None]
        trials = self.task.trials(self.phenotype, weights, individual, trial, keys)
        results = trials.completed(self.robot.trace(trials))
        results.must_count()
        return results


def _finite(fitness: NDArray[np.float64]) -> NDArray[np.float64]:
    for place in np.flatnonzero(~np.isfinite(fitness))[:1].tolist():
        raise TrialVoid(f"trial {place} of {len(fitness)} has the fitness {fitness[place]}, which is no number")
    return fitness

"""The fitness of every candidate in every simulated robot: the prior of all that follows."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import ConfigError
from sceann_hil.network.coding import Bits
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.plugins import RobotConfig
from sceann_hil.robot.task import Task
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.run.transfer import cache
from sceann_hil.run.transfer.robots import DrawnRobots
from sceann_hil.seeds import Purpose, keys

PART = 10
"""Robots in one file of the cache: so much is lost at most when preparation is interrupted."""
MOST_STARTS = 16
"""Starts of a task that are looked at: more would only cost memory."""
_ROOT = 0
Report = Callable[[str, int, int], None]
"""Told what is being done, how many of it are done, and how many there are."""


def silent(what: str, done: int, total: int) -> None:
    """Nobody wants to know."""


@dataclass(frozen=True)
class World:
    """What simulated trials are made of.

    Attributes:
        phenotype: how a genome becomes a controller.
        task: what a trial is, in simulation.
        task_text: its section, for the cache.
        robots: the simulated robots.
        n_trials: of the task on the robot: as many as in simulation, or one there stands for all of them.
    """

    phenotype: Phenotype
    task: Task
    task_text: str
    robots: DrawnRobots
    n_trials: int

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """Which trials of the task are looked at: all, or `MOST_STARTS` evenly among them, shape ``(H,)``."""
        n = self.n_trials
        return np.unique(np.linspace(0, n - 1, min(n, MOST_STARTS)).round().astype(np.int64))

    @property
    def simulated_starts(self) -> NDArray[np.int64]:
        """The same trials in simulation, shape ``(H,)``."""
        return self.starts if self.task.n_trials == self.n_trials else np.zeros_like(self.starts)

    def evaluator(self, body: RobotConfig) -> BatchEvaluator:
        """For trials in one robot, which is ready."""
        robot = body.build()
        robot.connect()
        return BatchEvaluator(self.phenotype, self.task, robot)

    def digest(self, *more: bytes | str) -> str:
        """Of all that decides what happens in this world."""
        import numba

        bodies = json.dumps([body.model_dump(mode="json") for body in self.robots.bodies])
        # the folder of the compiled code carries a hash of its sources
        code = Path(str(numba.config.CACHE_DIR)).name  # type: ignore[attr-defined]
        return cache.digest_of(code, self.task_text, repr(self.phenotype), bodies, *more)


@dataclass(frozen=True)
class Ensemble:
    """What K candidates did in M robots and H starts, one trial each.

    Attributes:
        fitness: float32, shape ``(M, K, H)``.
        durations_s: mean robot time of a trial, float64, shape ``(K, H)``.
        noise: standard deviation of a trial's fitness if the same controller runs again in the same robot.
        level: fitness from which on a trial is a success; None if success is not a matter of fitness.
        robots: the simulated robots.
    """

    fitness: NDArray[np.float32]
    durations_s: NDArray[np.float64]
    noise: float
    level: float | None
    robots: DrawnRobots

    @cached_property
    def mean(self) -> NDArray[np.float64]:
        """Over the robots, shape ``(K, H)``."""
        return np.asarray(self.fitness.mean(axis=0, dtype=np.float64))

    @property
    def spread(self) -> float:
        """Standard deviation of a trial's fitness over the robots, averaged over candidates and starts."""
        return float(np.sqrt(self.fitness.var(axis=0, dtype=np.float64).mean()))

    @property
    def success(self) -> NDArray[np.float64]:
        """Part of its trials in which each candidate succeeds, over all robots, shape ``(K,)``."""
        if self.level is None:
            return np.full(self.fitness.shape[1], np.nan)
        return np.asarray((self.fitness >= self.level).mean(axis=(0, 2)))


Arrays = dict[str, NDArray[Any]]
Compute = Callable[[World, Bits, list[range]], Iterator[tuple[range, Arrays]]]
"""What the candidates do in some parts of the ensemble, each with the numbers of its robots, in any order."""


def here(world: World, genomes: Bits, parts: list[range]) -> Iterator[tuple[range, Arrays]]:
    """On all cores of this machine."""
    for numbers in parts:
        yield numbers, part_of_ensemble(world, genomes, numbers)


def make_ensemble(world: World, genomes: Bits, report: Report = silent, compute: Compute = here) -> Ensemble:
    """Run every candidate once from every start in every robot, or take what is known already.

    Args:
        world: robots and task.
        genomes: candidates, shape ``(K, L)``.
        report: told after every part.
        compute: what computes the parts that are not known.

    Raises:
        ConfigError: the task's fitness has no bounds, or success differs from fitness.
        TrialVoid: a simulated trial had no result.
    """
    check_scale(world.task)
    folder = cache.cache_folder("ensemble", world.digest(np.packbits(genomes).tobytes(), str(genomes.shape)))
    n_robots = len(world.robots)
    whole = [range(first, min(first + PART, n_robots)) for first in range(0, n_robots, PART)]
    paths = {numbers: folder / f"robots-{numbers.start:04d}.npz" for numbers in whole}
    known = {numbers: part for numbers in whole if (part := cache.load(paths[numbers])) is not None}
    report("simulated robots", sum(map(len, known)), n_robots)
    for numbers, part in compute(world, genomes, [numbers for numbers in whole if numbers not in known]):
        cache.save(paths[numbers], part)
        known[numbers] = part
        report("simulated robots", sum(map(len, known)), n_robots)
    cache.prune(folder)
    parts = [known[numbers] for numbers in whole]
    fitness = np.concatenate([part["fitness"] for part in parts])
    return Ensemble(
        fitness=fitness,
        durations_s=np.asarray(sum(part["durations_s"] for part in parts) / n_robots),
        noise=float(np.sqrt(np.mean([part["noise_variance"] for part in parts]))),
        level=_level(parts, world.task.best_fitness),
        robots=world.robots,
    )


def check_scale(task: Task) -> None:
    """Refuse a task whose trials cannot be compared.

    Raises:
        ConfigError: its fitness has no bounds.
    """
    if not np.isfinite([task.worst_fitness, task.best_fitness]).all() or task.best_fitness <= task.worst_fitness:
        raise ConfigError(
            f"task {task.name}: expected worst_fitness < best_fitness, both finite, got {task.worst_fitness:g} and "
            f"{task.best_fitness:g}: simulated and measured trials need one scale.",
            "Nothing was started. Give the task bounds of its fitness (task episode_return: keys worst and best).",
        )


def check_some_success(ensemble: Ensemble, task: Task) -> None:
    """Refuse an ensemble in which everything fails: it says nothing of which candidate to try.

    Raises:
        ConfigError: no trial in it was worth more than the worst there is.
    """
    if float(ensemble.fitness.max()) <= task.worst_fitness:
        robots, candidates, starts = ensemble.fitness.shape
        raise ConfigError(
            f"Every candidate fails in every simulated robot: {robots * candidates * starts:,} trials, all of fitness "
            f"{task.worst_fitness:g}. They do not say which one to try on the robot.",
            "Nothing was started. What may help: better candidates (--from, --evolve), another controller (n_hidden, "
            "neuron), robots that differ less (uncertainty.keys), or an easier task.",
        )


def part_of_ensemble(world: World, genomes: Bits, numbers: range) -> Arrays:
    """What the candidates do in the robots of these numbers."""
    shape = (len(genomes), len(world.starts))
    individual, start, trial = np.arange(shape[0])[:, None], world.starts, world.simulated_starts
    fitness = np.empty((len(numbers), *shape), np.float32)
    durations_s = np.zeros(shape)
    most_failure, noise_variance = -np.inf, 0.0
    successes: list[NDArray[np.float64]] = []
    for place, number in enumerate(numbers):
        evaluator = world.evaluator(world.robots.bodies[number])
        outcomes = evaluator.evaluate(genomes, keys(_ROOT, Purpose.ENSEMBLE, number, 0, individual, start), trial)
        fitness[place] = outcomes.fitness
        durations_s += outcomes.durations_s
        successes.append(outcomes.fitness[outcomes.succeeded])
        most_failure = max(most_failure, outcomes.fitness[~outcomes.succeeded].max(initial=-np.inf))
        if place == 0:
            # the same once more, with other noise: what one trial cannot tell
            again = evaluator.evaluate(genomes, keys(_ROOT, Purpose.ENSEMBLE, number, 1, individual, start), trial)
            noise_variance = float(np.mean((again.fitness - outcomes.fitness) ** 2) / 2.0)
    succeeded = np.concatenate(successes)
    above = succeeded[succeeded > most_failure]
    return {
        "fitness": fitness,
        "durations_s": durations_s,
        "n_successes": np.array(len(succeeded)),
        "n_above": np.array(len(above)),
        "least_above": np.array(above.min(initial=np.inf)),
        "most_failure": np.array(most_failure),
        "noise_variance": np.array(noise_variance),
    }


def _level(parts: list[Arrays], best: float) -> float | None:
    """Fitness from which on a trial is a success; the best there is where nothing succeeded.

    A success in the very last step may be worth no more than a failure: a few of these do not count.
    """
    successes = sum(int(part["n_successes"]) for part in parts)
    if not successes:
        return best
    above = sum(int(part["n_above"]) for part in parts)
    level = min(float(part["least_above"]) for part in parts)
    misplaced = successes - above
    few = misplaced <= 0.2 * successes or misplaced <= 0.001 * sum(part["fitness"].size for part in parts)
    if not few or level <= max(float(part["most_failure"]) for part in parts):
        return None
    return level if np.isfinite(level) else best

"""Many runs of one experiment side by side: one robot call evaluates the generation of all of them.

A run alone would leave most of a simulation's lanes idle. Every run still has its own seed tree and its own algorithm
state, so run k of a block has the same bits as `sceann_hil.run.experiment.Experiment` with the same root seed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig, parse_config
from sceann_hil.evolution import Algorithm, State
from sceann_hil.network.coding import Bits, genome_to_hex
from sceann_hil.plugin_faults import blamed_on_plugins
from sceann_hil.robot import Robot
from sceann_hil.run.batch import BatchEvaluator, Outcomes
from sceann_hil.seeds import Purpose, generator, keys


@dataclass(frozen=True, slots=True)
class Generation:
    """One generation of every run (r runs, p individuals).

    Attributes:
        number: from 0.
        states: each run's algorithm state.
        fitness: mean over each individual's trials, float64, shape ``(r, p)``.
        successes: trials that reached what the task asks for, int64, shape ``(r, p)``.
        measures: what the algorithm is told besides, float64, shape ``(r, p, k)``; k is 0 if it wants nothing.
    """

    number: int
    states: list[State]
    fitness: NDArray[np.float64]
    successes: NDArray[np.int64]
    measures: NDArray[np.float64]

    @property
    def genomes(self) -> Bits:
        """All expressed bits, shape ``(r, p, L)``."""
        return np.stack([state.genomes for state in self.states])


@dataclass(frozen=True, slots=True)
class Block:
    """Some runs of one condition: the smallest piece of work.

    Attributes:
        condition: number of the condition in its study.
        first_run: number of the first of the consecutive runs.
        config: the condition's experiment, YAML.
        seeds: root seed of each run.
    """

    condition: int
    first_run: int
    config: str
    seeds: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class BlockResult:
    """What came out of a `Block` (r runs, g + 1 generations).

    Attributes:
        block: the work that was done.
        fitness: of each run's champion (`sceann_hil.run.champion`), float64, shape ``(r,)``.
        successes: its trials that reached what the task asks for, int64, shape ``(r,)``.
        genomes: its bits, hexadecimal.
        best: best fitness of every generation, float32, shape ``(r, g + 1)``.
    """

    block: Block
    fitness: NDArray[np.float64]
    successes: NDArray[np.int64]
    genomes: tuple[str, ...]
    best: NDArray[np.float32]


def compute_block(block: Block) -> BlockResult:
    """Run a block on one core.

    Raises:
        TrialVoid: the robot could not say what happened in a trial.
        PluginError: an error of a plug-in.
    """
    with blamed_on_plugins():
        return _computed(block)


def _computed(block: Block) -> BlockResult:
    config = parse_config(block.config, "the study's condition")
    robot = config.robot.build()
    robot.use_cores(1)
    best = []
    champions = _Champions(len(block.seeds))
    with robot:
        for generation in evolve_together(config, np.array(block.seeds, np.uint64), robot):
            best.append(generation.fitness.max(axis=1).astype(np.float32))
            if not config.algorithm.keeps_best or generation.number == config.algorithm.generations:
                champions.look_at(generation)
    return BlockResult(
        block=block,
        fitness=champions.fitness,
        successes=champions.successes,
        genomes=tuple(champions.genomes),
        best=np.stack(best, axis=1),
    )


class _Champions:
    """The best individual of each run in the generations that were looked at, the first of equals.

    As `sceann_hil.run.champion` says, these are all generations, or only the last one where the best is kept.
    """

    def __init__(self, n_runs: int) -> None:
        self.fitness = np.full(n_runs, -np.inf)
        self.successes = np.zeros(n_runs, np.int64)
        self.genomes = [""] * n_runs

    def look_at(self, generation: Generation) -> None:
        """One more generation."""
        for run, champion in enumerate(generation.fitness.argmax(axis=1).tolist()):
            if generation.fitness[run, champion] > self.fitness[run]:
                self.fitness[run] = generation.fitness[run, champion]
                self.successes[run] = generation.successes[run, champion]
                self.genomes[run] = genome_to_hex(generation.states[run].genomes[champion])


def evolve_together(config: ExperimentConfig, seeds: NDArray[np.uint64], robot: Robot) -> Iterator[Generation]:
    """Evolve several runs at once, yielding every generation once it is evaluated.

    Args:
        config: the experiment; its own seed is not used.
        seeds: root seed of each run, below 2**63, shape ``(r,)``.
        robot: connected, as the configuration says; takes batches of any size.

    Raises:
        ValueError: the robot takes no batches.
        TrialVoid: the robot could not say what happened in a trial.
    """
    algorithm: Any = config.algorithm.for_experiment(config)
    evaluator = _Evaluator(BatchEvaluator.of(config, robot), seeds, algorithm)
    states = [algorithm.start(generator(int(seed), Purpose.ALGORITHM, 0)) for seed in seeds]
    generation = evaluator.evaluate(0, states, None)
    yield generation
    for number in range(1, config.algorithm.generations + 1):
        states = [
            algorithm.tell_with_measures(state, fitness, measures, generator(int(seed), Purpose.ALGORITHM, number))
            for state, fitness, measures, seed in zip(
                states, generation.fitness, generation.measures, seeds, strict=True
            )
        ]
        generation = evaluator.evaluate(number, states, generation)
        yield generation


class _Evaluator:
    """`sceann_hil.run.evaluator.Evaluator` for many runs and no journal: the same trials, keys and means."""

    def __init__(self, batch: BatchEvaluator, seeds: NDArray[np.uint64], algorithm: Algorithm[Any]) -> None:
        self._batch = batch
        self._repeats = batch.robot.spec.noise_free and not batch.task.draws_starts
        self._seeds = seeds
        self._algorithm = algorithm

    def evaluate(self, number: int, states: list[State], before: Generation | None) -> Generation:
        genomes = np.stack([state.genomes for state in states])
        fitness = np.empty(genomes.shape[:2])
        successes = np.empty(genomes.shape[:2], np.int64)
        asked = self._batch.measures
        measures = np.empty((*genomes.shape[:2], 0 if asked is None else len(asked.columns)))
        todo = np.ones(genomes.shape[:2], np.bool_)
        n_trials = self._batch.task.n_trials
        of = [self._algorithm.wanted(state, n_trials) for state in states]
        every = np.ones(n_trials, np.bool_)
        wanted = np.stack([np.broadcast_to(every if one is None else one, (genomes.shape[1], n_trials)) for one in of])
        if before is not None and self._repeats and wanted.all():
            # the same genome in the same noise-free body does the same again, bit for bit
            parents = np.stack([state.parents for state in states])
            runs = np.arange(len(states))[:, None]
            todo = (genomes != before.genomes[runs, parents]).any(axis=-1)
            fitness[~todo] = before.fitness[runs, parents][~todo]
            successes[~todo] = before.successes[runs, parents][~todo]
            measures[~todo] = before.measures[runs, parents][~todo]
        if todo.any():
            outcomes = self._run(number, genomes[todo], *np.nonzero(todo))
            if wanted.all():
                fitness[todo], successes[todo] = outcomes.mean_fitness, outcomes.successes
            else:
                some = wanted[todo]
                fitness[todo] = outcomes.fitness.mean(axis=1, where=some)
                successes[todo] = (outcomes.succeeded & some).sum(axis=1)
            if outcomes.measures is not None:
                measures[todo] = outcomes.measures.mean(axis=1)
        return Generation(number, states, fitness, successes, measures)

    def _run(self, number: int, genomes: Bits, run: NDArray[np.intp], individual: NDArray[np.intp]) -> Outcomes:
        trial = np.arange(self._batch.task.n_trials)
        noise = keys(self._seeds[run][:, None], Purpose.TRIAL, number, individual[:, None], trial, 0)
        return self._batch.evaluate(genomes, noise)

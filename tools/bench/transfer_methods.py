"""What one can do with a few trials on a robot: transfer, and what it is compared with."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig
from sceann_hil.evolution.sga import SGA, SGAConfig
from sceann_hil.network.coding import Bits
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.run.transfer.algorithm import Transfer
from sceann_hil.run.transfer.state import Verdict
from sceann_hil.seeds import Purpose, keys

TRIALS = 40
FRESH = 8
"""Fresh evaluations in all trials of the task, for the true fitness."""
GENERATIONS = 50
LOOKED_AT = (0, 1, 2, 5, 10, 20, 30, 40, 50)
"""Generations whose best is measured."""


@dataclass
class Robot:
    """One robot and what was done with it: fitness of what each method recommends, by number of trials."""

    evaluator: BatchEvaluator
    seed: int
    used: int = 0
    curves: dict[str, list[float]] = field(default_factory=dict)

    def trial(self, genome: Bits, start: int) -> float:
        """Fitness of one trial."""
        return float(self.evaluator.evaluate(genome[None], self._noise((1, 1)), np.array([start])).fitness[0, 0])

    def generation(self, genomes: Bits) -> NDArray[np.float64]:
        """Mean fitness over all trials of the task."""
        return self.evaluator.evaluate(genomes, self._noise((len(genomes), 1))).mean_fitness

    def true(self, genome: Bits) -> float:
        """Fitness on fresh trials that cost nothing."""
        many = np.repeat(genome[None], FRESH, axis=0)
        n = self.evaluator.task.n_trials
        fresh = keys(self.seed, Purpose.REPEAT, np.arange(FRESH)[:, None], np.arange(n))
        return float(self.evaluator.evaluate(many, fresh).fitness.mean())

    def _noise(self, shape: tuple[int, int]) -> NDArray[np.uint64]:
        self.used += 1
        n = self.evaluator.task.n_trials if shape[1] == 1 and shape[0] > 1 else shape[1]
        return keys(self.seed, Purpose.TRIAL, self.used, np.arange(shape[0])[:, None], np.arange(n))


def robot_of(config: ExperimentConfig, body: dict[str, Any], seed: int) -> Robot:
    from sceann_hil import registry

    section = registry.load(registry.Group.ROBOTS, body["type"]).model_validate_json(json.dumps(body))
    robot = section.build()
    robot.connect()
    return Robot(BatchEvaluator(config.phenotype, config.build_task(), robot), seed)


def transfer(robot: Robot, algorithm: Transfer, trials: int) -> tuple[Verdict, int, list[float]]:
    """What it recommends after each trial; its verdict, trials and seconds a decision."""
    rng, seconds = np.random.default_rng(0), []
    state = algorithm.start(rng)
    known: dict[int, float] = {}
    curve = []
    for _ in range(trials + 1):
        if state.recommended not in known:
            known[state.recommended] = robot.true(state.candidates[state.recommended])
        curve.append(known[state.recommended])
        if state.start is None:
            break
        value = robot.trial(state.genomes[0], int(algorithm.prepared_by().world.starts[state.start]))
        began = time.perf_counter()
        state = algorithm.tell(state, np.array([value]), rng)
        seconds.append(time.perf_counter() - began)
    robot.curves["transfer"] = curve + curve[-1:] * (trials + 1 - len(curve))
    return state.verdict, len(state.observed), seconds


def thompson(robot: Robot, candidates: Bits, prior: tuple[NDArray[np.float64], NDArray[np.float64], float]) -> None:
    """Thompson sampling over the same candidates; each known by the ensemble's mean and spread, and by its trials."""
    mean, variance, noise = prior
    precision, weighted = 1.0 / variance, mean / variance
    rng = np.random.default_rng(robot.seed)
    curve, known = [], {}
    for _ in range(TRIALS + 1):
        best = int((weighted / precision).argmax())
        known.setdefault(best, None)
        if known[best] is None:
            known[best] = robot.true(candidates[best])
        curve.append(known[best])
        k = int((weighted / precision + rng.standard_normal(len(mean)) / np.sqrt(precision)).argmax())
        value = robot.trial(candidates[k], int(rng.integers(robot.evaluator.task.n_trials)))
        precision[k] += 1.0 / noise**2
        weighted[k] += value / noise**2
    robot.curves["Thompson sampling, no model"] = curve


def in_turn(robot: Robot, candidates: Bits, mean: NDArray[np.float64]) -> None:
    """The 20 best of simulation, in turn from one start after the other; the best mean so far is recommended."""
    order = np.argsort(-mean)[:20]
    values: list[list[float]] = [[] for _ in order]
    true = [robot.true(candidates[k]) for k in order]
    curve = [true[0]]
    for n in range(TRIALS):
        place = n % 20
        values[place].append(robot.trial(candidates[order[place]], (n // 20) % robot.evaluator.task.n_trials))
        curve.append(true[int(np.argmax([np.mean(v) if v else -1.0 for v in values]))])
    robot.curves["20 best of simulation in turn"] = curve


def genetic(robot: Robot, length: int, first: Bits | None, seed: int, population: int = 25) -> list[float]:
    """True fitness of each generation's best; a generation costs the population times the task's trials."""
    algorithm, rng = SGA(length, SGAConfig(population=population)), np.random.default_rng(seed)
    state = algorithm.start(rng) if first is None else algorithm.adopt(first, rng)
    curve = []
    for generation in range(GENERATIONS + 1):
        fitness = robot.generation(state.genomes)
        if generation in LOOKED_AT:
            curve.append(robot.true(state.genomes[int(fitness.argmax())]))
        state = algorithm.tell(state, fitness, rng)
    return curve

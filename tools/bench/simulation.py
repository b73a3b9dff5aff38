"""The lane engine: controller and body steps per second on the pole, SCEANN3 (2,3), and in goal reach (7,2)."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
from c_baseline import compiled_balance
from figures import Figure, median_s
from numpy.typing import NDArray
from numpy_baseline import balance as numpy_balance

from backends.cartpole import CartPole
from sceann_hil.config import load_config
from sceann_hil.network.coding import Coding, NetworkSize, Weights
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import Trials

GOAL_REACH = Path(__file__).parents[2] / "configs" / "goal_reach.yaml"
SIZE = NetworkSize(2, 3, 1)
START_RAD = float(np.deg2rad(1.0))
MAX_STEPS = 3000


def run() -> list[Figure]:
    """Ours on one and on two cores, hand-vectorised NumPy, hand-tuned C: the same random genomes."""
    weights = random_weights(400_000)
    one, two = CartPole(threads=1), CartPole(threads=2)
    random = trials_of(weights)
    balanced = weights[one.run(random).steps == MAX_STEPS]
    long = np.tile(balanced, (-(-3_000 // len(balanced)), 1, 1))
    figures = [_against_numpy(one, weights), _goal_reach()]
    exact, free = compiled_balance(exact=True), compiled_balance(exact=False)
    if exact is None or free is None:
        return [*figures, Figure("hand-tuned C", "no C compiler here")]
    for name, some, promised in (("random", weights, None), ("successful", long, 0.85)):
        ours, same = one.run(trials_of(some)), exact(some, START_RAD, MAX_STEPS)
        for mine, other in (
            (ours.steps, same.steps),
            (ours.hashes, same.hashes),
            (ours.final_states, same.final_states),
        ):
            if mine.tobytes() != other.tobytes():
                raise RuntimeError("the exact C baseline computes other bits than the engine")
        trials = trials_of(some)
        ours_s, exact_s, free_s = _interleaved_s(
            partial(one.run, trials),
            partial(exact, some, START_RAD, MAX_STEPS),
            partial(free, some, START_RAD, MAX_STEPS),
        )
        rate = float(ours.steps.sum()) / 1e6
        figures += [
            Figure(f"{name} genomes, one core", f"{rate / ours_s:.0f} million steps/s", ">= 60", rate / ours_s >= 60),
            Figure(
                f"{name} genomes, ours / C of the same bits",
                f"{exact_s / ours_s:.2f} x of {rate / exact_s:.0f} million steps/s",
            ),
            Figure(
                f"{name} genomes, ours / C with fast-math and without hash",
                f"{free_s / ours_s:.2f} x of {rate / free_s:.0f} million steps/s (C of the same bits: "
                f"{free_s / exact_s:.2f} x)",
                "" if promised is None else f">= {promised} x",
                None if promised is None else free_s / ours_s >= promised,
            ),
        ]
    halves = np.array_split(weights, 2)
    with ThreadPoolExecutor(2) as both:

        def side_by_side() -> None:
            list(both.map(lambda half: exact(half, START_RAD, MAX_STEPS), halves))

        alone_s, two_s, c_alone_s, c_two_s = _interleaved_s(
            partial(one.run, random),
            partial(two.run, random),
            partial(exact, weights, START_RAD, MAX_STEPS),
            side_by_side,
            clock=time.perf_counter,
        )
    scaling, c_scaling = alone_s / two_s, c_alone_s / c_two_s
    kept = scaling >= 0.97 * c_scaling if (os.cpu_count() or 1) >= 2 else None
    return [
        *figures,
        Figure("scaling to 2 cores", f"{scaling:.2f} x"),
        Figure("over that of two halves in C", f"{scaling / c_scaling:.2f} of {c_scaling:.2f} x", ">= 0.97", kept),
    ]


def _against_numpy(one: CartPole, weights: Weights) -> Figure:
    some = weights[:4_000]
    trials = trials_of(some)
    ours_s = median_s(lambda: one.run(trials), clock=time.thread_time)
    numpy_s = median_s(lambda: numpy_balance(some, START_RAD, MAX_STEPS), 3, time.thread_time)
    return Figure("ours / hand-vectorised NumPy", f"{numpy_s / ours_s:.0f} x", ">= 20 x", numpy_s >= 20 * ours_s)


def _goal_reach() -> Figure:
    """The paper's robot with 7 sensors: random genomes, all starts."""
    config = load_config(GOAL_REACH, ["robot.n_sensors=7", "controller.n_hidden=2"])
    robot, task = config.robot.build(), config.build_task()
    robot.use_cores(1)
    rng = np.random.default_rng(0)
    genomes = rng.integers(0, 2, (5_000, config.genome_length), dtype=np.uint8)
    individual, trial = np.indices((len(genomes), task.n_trials)).reshape(2, -1)
    keys = np.arange(len(trial), dtype=np.uint64)
    trials = task.trials(config.phenotype, config.phenotype.decode(genomes), individual, trial, keys)
    with robot:
        steps = int(robot.run(trials).steps.sum())
        rate = steps / median_s(lambda: robot.run(trials), clock=time.thread_time) / 1e6
    return Figure("goal reach (7,2), random genomes, one core", f"{rate:.0f} million steps/s", ">= 120", rate >= 120)


def _interleaved_s(*works: Callable[[], object], clock: Callable[[], float] = time.thread_time) -> list[float]:
    """Shortest duration of each of some works, taken in turns so that other work on the machine meets all of them."""
    shortest_s = [float("inf")] * len(works)
    for _ in range(7):
        for place, work in enumerate(works):
            began_s = clock()
            work()
            shortest_s[place] = min(shortest_s[place], clock() - began_s)
    return shortest_s


def random_weights(n: int) -> Weights:
    """n random genomes, decoded."""
    rng = np.random.default_rng(0)
    return Coding.SCEANN3.decode(rng.integers(0, 2, (n, Coding.SCEANN3.genome_length(SIZE)), dtype=np.uint8), SIZE)


def trials_of(weights: Weights) -> Trials:
    """The paper's one trial for each network."""
    starts = np.zeros((len(weights), 4))
    starts[:, 2] = START_RAD
    return one_each(SIZE, weights, starts, MAX_STEPS)


def one_each(size: NetworkSize, weights: Weights, starts: NDArray[np.float64], max_steps: int) -> Trials:
    """One trial for each network, shape of the weights ``(n, n_neurons, n_sources)``, from its own start."""
    numbers = np.arange(len(weights))
    return Trials(
        size, Dynamics(), weights, numbers.astype(np.int32), starts, numbers.astype(np.uint64), max_steps, numbers
    )

"""The lane engine: controller and body steps per second on the pole, SCEANN3 (2,3)."""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from c_baseline import compiled_balance
from figures import Figure, median_s
from numpy.typing import NDArray
from numpy_baseline import balance as numpy_balance

from backends.cartpole import CartPole
from sceann_hil.network.coding import Coding, NetworkSize, Weights
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import Trials

SIZE = NetworkSize(2, 3, 1)
START_RAD = float(np.deg2rad(1.0))
MAX_STEPS = 3000


def run() -> list[Figure]:
    """Ours on one and on two cores, hand-vectorised NumPy, hand-tuned C: the same random genomes."""
    weights = random_weights(400_000)
    some = weights[:4_000]
    one, two = CartPole(threads=1), CartPole(threads=2)
    steps = int(one.run(trials_of(weights)).steps.sum())
    some_steps = int(numpy_balance(some, START_RAD, MAX_STEPS).sum())
    ours = steps / median_s(lambda: one.run(trials_of(weights)), clock=time.thread_time)
    numpy_rate = some_steps / median_s(lambda: numpy_balance(some, START_RAD, MAX_STEPS), 3, time.thread_time)
    balanced = weights[one.run(trials_of(weights)).steps == MAX_STEPS]
    long = np.tile(balanced, (-(-3_000 // len(balanced)), 1, 1))
    long_rate = len(long) * MAX_STEPS / median_s(lambda: one.run(trials_of(long)), clock=time.thread_time)
    trials = trials_of(weights)
    scaling = median_s(lambda: one.run(trials)) / median_s(lambda: two.run(trials))
    figures = [
        Figure("random genomes, one core", f"{ours / 1e6:.0f} million steps/s", ">= 60 (goal 100)", ours >= 60e6),
        Figure("successful genomes, one core", f"{long_rate / 1e6:.0f} million steps/s"),
        Figure("hand-vectorised NumPy", f"{numpy_rate / 1e6:.2f} million steps/s"),
        Figure("ours / NumPy", f"{ours / numpy_rate:.0f} x", ">= 20 x", ours >= 20 * numpy_rate),
        Figure("scaling to 2 cores", f"{scaling:.2f} x", ">= 1.8 x", scaling_kept(scaling)),
    ]
    c_balance = compiled_balance()
    if c_balance is None:
        figures.append(Figure("hand-tuned C", "no C compiler here"))
        return figures
    c_steps = int(c_balance(weights, START_RAD, MAX_STEPS).sum())
    c_rate = c_steps / median_s(lambda: c_balance(weights, START_RAD, MAX_STEPS), clock=time.thread_time)
    halves = np.array_split(weights, 2)
    with ThreadPoolExecutor(2) as both:

        def side_by_side() -> None:
            list(both.map(lambda half: c_balance(half, START_RAD, MAX_STEPS), halves))

        c_scaling = median_s(lambda: c_balance(weights, START_RAD, MAX_STEPS)) / median_s(side_by_side)
    c_long = len(long) * MAX_STEPS / median_s(lambda: c_balance(long, START_RAD, MAX_STEPS), clock=time.thread_time)
    return [
        *figures,
        Figure("hand-tuned C (fast-math, no state hash), random genomes", f"{c_rate / 1e6:.0f} million steps/s"),
        Figure("its scaling to 2 cores, two halves side by side", f"{c_scaling:.2f} x"),
        Figure("ours / C, random genomes", f"{ours / c_rate:.2f} x"),
        Figure("ours / C, successful genomes", f"{long_rate / c_long:.2f} x"),
    ]


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


def scaling_kept(ratio: float) -> bool | None:
    """The promise is about two cores."""
    return ratio >= 1.8 if (os.cpu_count() or 1) >= 2 else None

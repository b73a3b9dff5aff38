"""Environments of others as robots: time of a step, controller and record included, over the bare environment's.

The bare loop does the same episodes with the same seeds and actions, so that resets count on both sides.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from figures import Figure

from sceann_hil.config import load_config
from sceann_hil.network.controller import ONE
from sceann_hil.robot import Trace
from sceann_hil.run.batch import BatchEvaluator

CONFIGS = Path(__file__).parents[2] / "configs" / "gymnasium"
GENOMES = 200


def run() -> list[Figure]:
    """Random genomes and the best of them, many trials in one batch."""
    return [_figure("cartpole", 1.8), _figure("inverted_pendulum", 1.2)]


def _figure(name: str, most: float) -> Figure:
    config = load_config(CONFIGS / f"{name}.yaml")
    robot_config: Any = config.robot
    bits = np.random.default_rng(0).integers(0, 2, (GENOMES, config.genome_length), dtype=np.uint8)
    with config.robot.build() as robot:
        batch = BatchEvaluator.of(config, robot)
        weights = batch.phenotype.coding.decode(bits, batch.phenotype.size)
        n = batch.task.n_trials
        everyone = batch.task.trials(batch.phenotype, weights, np.arange(GENOMES)[:, None], np.arange(n), np.uint64(0))
        first = robot.run(everyone)
        best = int(batch.task.fitness(first).reshape(GENOMES, n).mean(axis=1).argmax())
        trials = batch.task.trials(batch.phenotype, weights, np.full((50, 1), best), np.arange(n), np.uint64(0))
        started = time.thread_time()
        results = robot.run(trials)
        ours_s = time.thread_time() - started
    bare = gymnasium.make(robot_config.env).unwrapped
    actions = [_actions(bare, trace) for trace in results.traces or ()]
    started = time.thread_time()
    for seed, episode in zip(trials.starts[:, 0].astype(int).tolist(), actions, strict=True):
        bare.reset(seed=seed)
        for action in episode:
            bare.step(action)
    ratio = ours_s / (time.thread_time() - started)
    steps = int(results.steps.sum())
    measured = f"{1e6 * ours_s / steps:.1f} us a step, {ratio:.2f} x the bare environment ({steps} steps)"
    return Figure(robot_config.env, measured, f"<= {most:g} x", ratio <= most)


def _actions(bare: Any, trace: Trace) -> list[Any]:
    motors = trace.x[:, -1:] / ONE
    if hasattr(bare.action_space, "n"):
        return [int(value >= 0.5) for value in motors[:, 0]]
    low, high = bare.action_space.low, bare.action_space.high
    return list((low + (high - low) * motors).astype(np.float32))

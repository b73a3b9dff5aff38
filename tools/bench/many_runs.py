"""Trials of many runs that are evolved side by side, in one robot call."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig
from sceann_hil.network.coding import Bits
from sceann_hil.robot import Results, Robot


def run_trials(
    config: ExperimentConfig,
    robot: Robot,
    genomes: Bits,
    run: NDArray[np.intp],
    individual: NDArray[np.intp],
    trial: NDArray[np.intp],
    key: NDArray[np.uint64],
) -> Results:
    """Some trials of all runs.

    Args:
        config: of every run.
        robot: connected.
        genomes: bits, shape ``(runs, population, L)``.
        run: of each trial, shape ``(n,)``.
        individual: of each trial, shape ``(n,)``.
        trial: number of the task's trial, shape ``(n,)``.
        key: of the noise, shape ``(n,)``.

    Raises:
        TrialVoid: a trial ended without a result.
    """
    task = config.build_task()
    weights = config.phenotype.decode(genomes.reshape(-1, genomes.shape[-1]))
    trials = task.trials(config.phenotype, weights, run * genomes.shape[1] + individual, trial, key)
    results = trials.completed(robot.run(trials))
    results.must_count()
    return results

"""Trials of random controllers, the same in every process: what the kits run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import RobotSpec, Trials

_SEED = 2024


def random_trials(
    spec: RobotSpec, start: Sequence[float], n: int, max_steps: int, size: NetworkSize | None = None, first_id: int = 0
) -> Trials:
    """One trial of each of n random networks, all from one start.

    Args:
        spec: of the robot.
        start: start values.
        n: how many.
        max_steps: of each trial.
        size: of the networks; two hidden neurons by default.
        first_id: number of the first trial.
    """
    size = size or NetworkSize(spec.n_sensors, 2, spec.n_motors)
    rng = np.random.default_rng(_SEED)
    return Trials(
        size=size,
        dynamics=Dynamics(),
        weights=rng.integers(-1, 2, (n, size.n_neurons, size.n_sources)).astype(np.int8),
        genome_index=np.arange(n, dtype=np.int32),
        starts=np.tile(np.array([start], np.float64), (n, 1)),
        keys=rng.integers(0, 2**64, n, np.uint64),
        max_steps=max_steps,
        ids=np.arange(first_id, first_id + n, dtype=np.int64),
        run_id=int(rng.integers(2**16)),
    )

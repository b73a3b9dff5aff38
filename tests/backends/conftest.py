"""Trials for tests of simulated robots."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from sceann_hil import seeds
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import Robot, Trials

MakeTrials = Callable[..., Trials]


@pytest.fixture
def make_trials() -> MakeTrials:
    """Random networks from one start, or from a start per trial."""

    def make(
        robot: Robot,
        n: int,
        *,
        start: object,
        max_steps: int,
        n_hidden: int = 2,
        coding: Coding = Coding.SCEANN3,
        dynamics: Dynamics = Dynamics(),  # noqa: B008
        seed: int = 0,
    ) -> Trials:
        size = NetworkSize(robot.spec.n_sensors, n_hidden, robot.spec.n_motors)
        rng = np.random.default_rng(seed)
        genomes = rng.integers(0, 2, (n, coding.genome_length(size)), dtype=np.uint8)
        return Trials(
            size=size,
            dynamics=dynamics,
            weights=coding.decode(genomes, size),
            genome_index=np.arange(n, dtype=np.int32),
            starts=np.broadcast_to(np.asarray(start, np.float64), (n, len(robot.spec.start_fields))).copy(),
            keys=seeds.keys(seed, seeds.Purpose.TRIAL, np.arange(n)),
            max_steps=max_steps,
            ids=np.arange(1, n + 1),
        )

    return make

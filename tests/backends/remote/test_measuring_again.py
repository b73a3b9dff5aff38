"""A measurement whose trial came to nothing is done again, as a trial of its own."""

from __future__ import annotations

import numpy as np
import pytest

from backends.remote import RemoteRobot
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.network.coding import Coding
from sceann_hil.network.controller import Dynamics
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import EndReason, Results, Trials
from sceann_hil.run.measuring import measure
from sceann_hil.tasks.pole_balancing import PoleBalancing
from tests.backends.remote.trials import SIZE, virtual_config


def test_a_void_trial_is_measured_again(virtual: VirtualPosix, monkeypatch: pytest.MonkeyPatch) -> None:
    """Regression: with the number of the first attempt, which the robot runs only once, every other was void too."""
    ends: list[EndReason] = []
    run = RemoteRobot.run

    def spoilt_once(self: RemoteRobot, trials: Trials) -> Results:
        results = run(self, trials)
        ends.append(EndReason(int(results.end_reasons[0])))
        return Results.void(1, EndReason.LINK_LOST, 0) if len(ends) == 1 else results

    monkeypatch.setattr(RemoteRobot, "run", spoilt_once)
    genomes = np.zeros((1, Coding.SCEANN3.genome_length(SIZE)), np.uint8)
    phenotype = Phenotype(Coding.SCEANN3, SIZE, Dynamics())
    with virtual_config(virtual, "onboard").build() as robot:
        measured = measure(robot, phenotype, PoleBalancing(10, 1.0), genomes, 1, root_seed=3)
    assert measured.fitness.shape == (1, 1, 1)
    assert len(ends) == 2
    assert not ends[1].is_void

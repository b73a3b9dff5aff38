"""A study that is small enough for tests and large enough to be interrupted."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sceann_hil.study import StudyReader

SMALL = """\
name: small
seed: 3
runs: 12
base:
  task: {type: pole_balancing, max_steps: 400}
  robot: {type: cartpole}
  controller: {coding: sceann3, n_hidden: 2}
  algorithm: {type: sga, population: 8, generations: 6}
grid:
  algorithm.type: [sga, oga]
  robot.n_sensors: [2, 4]
"""


def assert_same_results(one: Path, other: Path) -> None:
    """Every run of two studies is equal to the last bit."""
    with StudyReader(one) as left, StudyReader(other) as right:
        numbers = [condition.number for condition in left.conditions()]
        assert numbers == [condition.number for condition in right.conditions()]
        for number in numbers:
            ours, theirs = left.runs(number), right.runs(number)
            assert ours.genomes == theirs.genomes
            for name in ("numbers", "seeds", "fitness", "successes", "best"):
                np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name))

"""The one place where genomes and a task become trials, and the one that says which results count."""

from __future__ import annotations

import numpy as np
import pytest

from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import EndReason, Results, TrialVoid
from sceann_hil.tasks.goal_reach import GoalReach, GoalReachConfig

PHENOTYPE = Phenotype(Coding.SCEANN3, NetworkSize(2, 1, 2), Dynamics())
TASK = GoalReach(GoalReachConfig(max_steps=50, start_m=(0.1, 0.2), headings_deg=(0.0, 90.0, 180.0)))


def _weights(n: int) -> np.ndarray:
    rng = np.random.default_rng(1)
    return PHENOTYPE.decode(rng.integers(0, 2, (n, PHENOTYPE.genome_length), np.uint8))


def test_all_trials_of_all_individuals_are_one_broadcast_in_c_order() -> None:
    noise = np.arange(6, dtype=np.uint64).reshape(2, 3) + np.uint64(2**63)
    trials = TASK.trials(PHENOTYPE, _weights(2), np.arange(2)[:, None], np.arange(3), noise)
    assert trials.genome_index.tolist() == [0, 0, 0, 1, 1, 1]
    assert np.array_equal(trials.starts, np.tile(TASK.starts, (2, 1)))
    assert trials.keys.tolist() == [2**63 + i for i in range(6)]
    assert trials.ids.tolist() == list(range(6))
    assert (trials.max_steps, trials.size, trials.run_id) == (50, PHENOTYPE.size, 0)
    assert (trials.genome_index.dtype, trials.keys.dtype) == (np.int32, np.uint64)


def test_journalled_starts_and_numbers_are_kept() -> None:
    starts = np.array([[0.3, 0.3, 1.0]])
    trials = TASK.trials(PHENOTYPE, _weights(1), 0, 2, 7, np.array([42]), starts=starts, run_id=9)
    assert trials.starts.tolist() == [[0.3, 0.3, 1.0]]
    assert (trials.ids.tolist(), trials.keys.tolist(), trials.run_id) == ([42], [7], 9)


def _ended(*reasons: int) -> Results:
    results = Results.void(len(reasons), EndReason.LINK_LOST, 0)
    results.end_reasons[:] = reasons
    return results


def test_only_known_ends_of_the_task_count() -> None:
    everything = _ended(*range(256))
    expected = [reason for reason in EndReason if not reason.is_void]
    assert np.flatnonzero(everything.counts).tolist() == expected


@pytest.mark.parametrize(("reason", "told"), [(EndReason.FAULT, "fault"), (EndReason.OPERATOR, "operator"), (7, "7")])
def test_no_number_is_made_of_a_trial_that_measured_nothing(reason: int, told: str) -> None:
    _ended(0, 1, 2, 3).must_count()
    with pytest.raises(TrialVoid, match=f"trial 2 of 4 .*{told}"):
        _ended(0, 1, reason, 3).must_count()

"""The batch evaluator: the numbers of single trials, and no number where a trial is void."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backends.cartpole import CartPole
from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.simulation.gap import Gap, Spread
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import EndReason, Results, RobotSpec, Trials, TrialVoid
from sceann_hil.run import batch as module
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.tasks.goal_reach import GoalReach, GoalReachConfig
from sceann_hil.tasks.pole_balancing import PoleBalancing, PoleBalancingConfig

PHENOTYPE = Phenotype(Coding.SCEANN3, NetworkSize(3, 2, 2), Dynamics())
SHORT_POLE = PoleBalancingConfig(max_steps=50, start_angle_deg=4.0)
TASK = GoalReach(GoalReachConfig(max_steps=60, start_m=(0.03, 0.03), headings_deg=(0.0, 45.0, 90.0)))
NOISE = np.random.default_rng(2).integers(0, 2**63, (9, 3), dtype=np.uint64)


def genomes(n: int) -> np.ndarray:  # type: ignore[type-arg]
    return np.random.default_rng(1).integers(0, 2, (n, PHENOTYPE.genome_length), dtype=np.uint8)


def test_every_trial_of_a_batch_is_the_trial_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = DifferentialDrive(DifferentialDriveConfig(n_sensors=3), gap=Gap(sensor_noise=Spread(0.02)))
    found = BatchEvaluator(PHENOTYPE, TASK, robot).evaluate(genomes(9), NOISE)
    weights = PHENOTYPE.decode(genomes(9))
    for genome, trial in ((0, 0), (4, 2), (8, 1)):
        alone = robot.run(TASK.trials(PHENOTYPE, weights, genome, trial, NOISE[genome, trial]))
        assert found.fitness[genome, trial] == TASK.fitness(alone)[0]
        assert found.succeeded[genome, trial] == TASK.succeeded(alone)[0]
    monkeypatch.setattr(module, "TRIALS_AT_ONCE", 7)
    in_parts = BatchEvaluator(PHENOTYPE, TASK, robot).evaluate(genomes(9), NOISE)
    np.testing.assert_array_equal(in_parts.fitness, found.fitness)
    np.testing.assert_array_equal(in_parts.succeeded, found.succeeded)
    np.testing.assert_array_equal(found.mean_fitness, found.fitness.mean(axis=1))
    np.testing.assert_array_equal(found.successes, found.succeeded.sum(axis=1))


def test_trials_can_be_chosen_and_repeated() -> None:
    evaluator = BatchEvaluator(
        PHENOTYPE, TASK, DifferentialDrive(DifferentialDriveConfig(n_sensors=3, motion_noise=0.0))
    )
    all_of_them = evaluator.evaluate(genomes(4))
    chosen = evaluator.evaluate(genomes(4), trial=np.array([2, 0, 2]))
    np.testing.assert_array_equal(chosen.fitness, all_of_them.fitness[:, [2, 0, 2]])


def test_traces_are_of_the_same_trials() -> None:
    evaluator = BatchEvaluator(PHENOTYPE, TASK, DifferentialDrive(DifferentialDriveConfig(n_sensors=3)))
    traced = evaluator.trace(genomes(9), NOISE)
    np.testing.assert_array_equal(TASK.fitness(traced).reshape(9, 3), evaluator.evaluate(genomes(9), NOISE).fitness)
    assert traced.traces is not None
    assert [len(trace.sensors) for trace in traced.traces] == traced.steps.tolist()


class _Spoils(CartPole):
    """The end of its third trial is another one."""

    reason = int(EndReason.LINK_LOST)

    def run(self, trials: Trials) -> Results:
        results = super().run(trials)
        results.end_reasons[2] = self.reason
        return results

    trace = run


@pytest.mark.parametrize("reason", [*(int(r) for r in EndReason if r.is_void), 200])
def test_a_void_or_unknown_end_is_never_a_number(reason: int) -> None:
    robot = _Spoils()
    robot.reason = reason
    phenotype = Phenotype(Coding.SCEANN3, NetworkSize(2, 1, 1), Dynamics())
    evaluator = BatchEvaluator(phenotype, PoleBalancing(SHORT_POLE), robot)
    some = np.zeros((5, phenotype.genome_length), np.uint8)
    for call in (evaluator.evaluate, evaluator.trace):
        with pytest.raises(TrialVoid, match="no result"):
            call(some)


def test_a_fitness_that_is_no_number_is_refused() -> None:
    class _Spoilt(PoleBalancing):
        def fitness(self, results: Results) -> np.ndarray:  # type: ignore[type-arg]
            return np.where(np.arange(len(results)) == 3, np.nan, super().fitness(results))

    phenotype = Phenotype(Coding.SCEANN3, NetworkSize(2, 1, 1), Dynamics())
    evaluator = BatchEvaluator(phenotype, _Spoilt(SHORT_POLE), CartPole())
    with pytest.raises(TrialVoid, match="trial 3 of 5 has the fitness nan"):
        evaluator.evaluate(np.zeros((5, phenotype.genome_length), np.uint8))


@pytest.mark.parametrize("settings", [{"attended": True}, {"batch_size": 1}])
def test_a_robot_that_takes_no_batches_is_refused(settings: dict[str, int]) -> None:
    class _OneByOne(CartPole):
        @property
        def spec(self) -> RobotSpec:
            return replace(super().spec, **settings)

    with pytest.raises(ValueError, match="runs any number of trials at once"):
        BatchEvaluator(PHENOTYPE, TASK, _OneByOne())

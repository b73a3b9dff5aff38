"""The lane engine: the reference's bits, whatever runs beside a trial."""

from __future__ import annotations

import numpy as np
import pytest

from backends.cartpole import CartPole, CartPoleConfig
from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.simulation.engine import SimulatedRobot
from backends.simulation.gap import Gap, Spread
from sceann_hil.network.coding import MAX_SOURCES, Coding
from sceann_hil.network.controller import Controller, Dynamics, Neuron, state_hash
from sceann_hil.network.neurons import LANES
from sceann_hil.robot import EndReason, Results, Trials
from tests.backends.conftest import MakeTrials

CORNER = (0.0275, 0.0275, 0.6)
TILTED = (0.0, 0.0, 0.0175, 0.0)
GAP = Gap(
    sensor_offset=Spread(0.0, half_width=0.02),
    sensor_gain=Spread(1.0, deviation=0.05),
    sensor_noise=Spread(0.01),
    motor_gain=Spread(1.0, half_width=0.1),
    motor_dead_band=Spread(0.02),
    latency_steps=Spread(1.0, half_width=1.0),
)
DYNAMICS = [Dynamics(), Dynamics(Neuron.MEMORYLESS), Dynamics(initial_output=0)]


def assert_same(a: Results, b: Results) -> None:
    for name in ("end_reasons", "steps", "hashes", "final_states", "durations_s"):
        assert np.array_equal(getattr(a, name), getattr(b, name)), name


def assert_traces_follow_the_reference(trials: Trials, results: Results) -> None:
    assert results.traces is not None
    for i, trace in enumerate(results.traces):
        controller = Controller(trials.weights[trials.genome_index[i]], trials.size, trials.dynamics)
        for k, wire in enumerate(trace.sensors):
            controller.step(wire)
            assert np.array_equal(controller.u, trace.u[k])
            assert np.array_equal(controller.x, trace.x[k])
        assert len(trace.sensors) == results.steps[i]
        assert state_hash(trace.u) == results.hashes[i]
        assert np.array_equal(trace.state[-1], results.final_states[i])


@pytest.mark.parametrize("dynamics", DYNAMICS, ids=["accumulating", "memoryless", "initial output 0"])
@pytest.mark.parametrize("coding", Coding)
def test_every_state_equals_the_reference_on_the_cart_pole(
    coding: Coding, dynamics: Dynamics, make_trials: MakeTrials
) -> None:
    robot = CartPole(CartPoleConfig(n_sensors=4))
    trials = make_trials(robot, 80, start=TILTED, max_steps=400, coding=coding, dynamics=dynamics, n_hidden=3)
    assert_traces_follow_the_reference(trials, robot.trace(trials))


@pytest.mark.parametrize("n_sensors", [1, 7, MAX_SOURCES - 5])
@pytest.mark.parametrize("coding", Coding)
def test_every_state_equals_the_reference_on_the_differential_drive(
    coding: Coding, n_sensors: int, make_trials: MakeTrials
) -> None:
    robot = DifferentialDrive(DifferentialDriveConfig(n_sensors=n_sensors), gap=GAP)
    trials = make_trials(robot, 70, start=CORNER, max_steps=200, coding=coding, n_hidden=3)
    assert_traces_follow_the_reference(trials, robot.trace(trials))


def test_a_long_trial_equals_the_reference(make_trials: MakeTrials) -> None:
    robot = DifferentialDrive(DifferentialDriveConfig(n_sensors=5, target_m=(0.0, 0.0), target_radius_m=1e-6))
    trials = make_trials(robot, 3, start=(0.3, 0.3, 0.0), max_steps=10_000)
    results = robot.trace(trials)
    assert results.steps.max() == 10_000
    assert_traces_follow_the_reference(trials, results)


@pytest.mark.parametrize("gap", [Gap(), GAP], ids=["no gap", "gap"])
def test_a_trial_has_the_same_bits_alone_in_a_batch_and_on_any_number_of_threads(
    gap: Gap, make_trials: MakeTrials
) -> None:
    one, many = (
        DifferentialDrive(gap=gap, threads=1),
        DifferentialDrive(gap=gap, threads=3),
    )
    trials = make_trials(one, 5 * LANES + 7, start=CORNER, max_steps=200)
    batch = one.run(trials)
    assert_same(many.run(trials), batch)
    order = np.random.default_rng(1).permutation(len(trials))
    shuffled = one.run(trials.take(order))
    assert np.array_equal(shuffled.hashes, batch.hashes[order])
    for i in (0, LANES - 1, LANES, len(trials) - 1):
        alone = one.run(trials.take(slice(i, i + 1)))
        assert alone.hashes[0] == batch.hashes[i]
        assert np.array_equal(alone.final_states[0], batch.final_states[i])


def test_traced_and_untraced_trials_have_the_same_bits(make_trials: MakeTrials) -> None:
    robot = CartPole()
    trials = make_trials(robot, 2 * LANES + 5, start=TILTED, max_steps=500, n_hidden=3)
    assert_same(robot.trace(trials), robot.run(trials))


def test_no_trials_give_no_results(make_trials: MakeTrials) -> None:
    robot: SimulatedRobot = CartPole()
    assert len(robot.run(make_trials(robot, 1, start=TILTED, max_steps=5).take(slice(0, 0)))) == 0


def test_a_trial_ends_at_the_step_limit(make_trials: MakeTrials) -> None:
    robot = CartPole()
    results = robot.run(make_trials(robot, 10, start=TILTED, max_steps=1))
    assert results.steps.tolist() == [1] * 10
    assert set(results.end_reasons.tolist()) == {EndReason.TIME_UP}
    assert results.durations_s.tolist() == [0.02] * 10


def test_a_network_that_does_not_fit_the_robot_is_refused(make_trials: MakeTrials) -> None:
    trials = make_trials(CartPole(CartPoleConfig(n_sensors=4)), 1, start=TILTED, max_steps=5)
    with pytest.raises(ValueError, match="expected 2 sensors and 1 motors for cartpole, got 4 and 1"):
        CartPole().run(trials)

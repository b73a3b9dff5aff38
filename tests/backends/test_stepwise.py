"""A body moved tick by tick has the lane engine's bits."""

from __future__ import annotations

import numpy as np
import pytest

from backends.cartpole import CartPole, CartPoleConfig
from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.simulation.engine import SimulatedRobot
from backends.simulation.gap import Gap, Spread
from backends.simulation.stepwise import StepwiseBody
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Controller, Dynamics, Neuron, state_hash
from sceann_hil.network.recompute import recompute
from sceann_hil.robot import EndReason, Trials

GAP = Gap(
    sensor_offset=Spread(0.01, half_width=0.02),
    sensor_gain=Spread(1.0, deviation=0.03),
    sensor_noise=Spread(0.01),
    motor_gain=Spread(0.95, half_width=0.05),
    motor_dead_band=Spread(0.02),
    latency_steps=Spread(2.0),
)
ROBOTS = [
    CartPole(),
    CartPole(CartPoleConfig(n_sensors=4), gap=GAP),
    DifferentialDrive(DifferentialDriveConfig(n_sensors=3)),
    DifferentialDrive(gap=GAP),
]


@pytest.mark.parametrize("neuron", Neuron)
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda r: f"{r.spec.name}-{r.gap.is_none}")
def test_a_trial_stepped_by_hand_has_the_engines_bits(robot: SimulatedRobot, neuron: Neuron) -> None:
    rng = np.random.default_rng(3)
    size = NetworkSize(robot.spec.n_sensors, 2, robot.spec.n_motors)
    n = 12
    trials = Trials(
        size=size,
        dynamics=Dynamics(neuron),
        weights=rng.integers(-1, 2, (n, size.n_neurons, size.n_sources)).astype(np.int8),
        genome_index=np.arange(n, dtype=np.int32),
        starts=np.abs(rng.normal(0.1, 0.03, (n, len(robot.spec.start_fields)))),
        keys=rng.integers(0, 2**64, n, np.uint64),
        max_steps=80,
        ids=np.arange(n),
    )
    results = robot.trace(trials)
    assert results.traces is not None
    for k in range(n):
        body, controller = StepwiseBody(robot), Controller(trials.weights[k], size, trials.dynamics)
        body.reset(trials.starts[k], trials.keys[k])
        trace = results.traces[k]
        end = None
        for step in range(results.steps[k]):
            assert np.array_equal(body.state, trace.state[step])
            wire = body.sense()
            assert np.array_equal(wire, trace.sensors[step])
            end = body.move(controller.step(wire).tolist())
        assert np.array_equal(body.state, results.final_states[k])
        assert (end or EndReason.TIME_UP) == results.end_reasons[k]
        neurons = recompute(trials.weights[k], size, trials.dynamics, trace.sensors)
        assert np.array_equal(neurons.u, trace.u)
        assert np.array_equal(neurons.x, trace.x)
        assert neurons.hashes[-1] == results.hashes[k] == state_hash(trace.u)

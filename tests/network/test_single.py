"""A network stepped alone is the reference, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from sceann_hil.network.coding import NetworkSize, Weights
from sceann_hil.network.controller import ONE, Controller, Dynamics, Neuron, quantise_sensors, state_hash
from sceann_hil.network.recompute import recompute
from sceann_hil.network.single import SingleNetwork

SIZES = [NetworkSize(1, 0, 1), NetworkSize(2, 3, 1), NetworkSize(12, 7, 4)]


@pytest.mark.parametrize("dynamics", [Dynamics(), Dynamics(Neuron.MEMORYLESS), Dynamics(initial_output=0)])
@pytest.mark.parametrize("size", SIZES, ids=str)
def test_every_step_is_the_reference_s(size: NetworkSize, dynamics: Dynamics) -> None:
    rng = np.random.default_rng(size.n_sources)
    for _ in range(20):
        weights = rng.integers(-1, 2, (size.n_neurons, size.n_sources)).astype(np.int8)
        values = rng.uniform(-0.2, 1.2, (300, size.n_sensors))
        network, reference = SingleNetwork(weights, size, dynamics, 300), Controller(weights, size, dynamics)
        for step, row in enumerate(values):
            motors = network.step(step, row)
            expected = reference.step(quantise_sensors(row))
            assert motors is not None
            assert np.array_equal(motors, expected / ONE)
            assert np.array_equal(network.u[step], reference.u)
            assert np.array_equal(network.x[step], reference.x)
        assert np.array_equal(network.sensors, quantise_sensors(values))
        again = recompute(weights, size, dynamics, network.sensors)
        assert np.array_equal(again.u, network.u)
        assert np.array_equal(again.x, network.x)
        assert again.hashes[-1] == state_hash(network.u)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_sensor_that_is_no_number_is_no_step(bad: float) -> None:
    network = SingleNetwork(np.ones((1, 3), np.int8), NetworkSize(2, 0, 1), Dynamics(), 5)
    assert network.step(0, np.array([0.5, bad])) is None


def test_motors_that_somebody_keeps_do_not_change() -> None:
    network = SingleNetwork(np.ones((1, 2), np.int8), NetworkSize(1, 0, 1), Dynamics(), 5)
    first = network.step(0, np.array([1.0]))
    assert first is not None
    kept = first.copy()
    network.step(1, np.array([1.0]))
    assert np.array_equal(first, kept)


@pytest.mark.parametrize(
    ("weights", "sensors", "message"),
    [
        (np.ones((1, 4), np.int8), np.zeros((5, 2), np.uint16), r"weights: expected shape \(1, 3\), got \(1, 4\)"),
        (np.ones((1, 3), np.int8), np.zeros((5, 1), np.uint16), r"sensors: expected shape \(any, 2\), got \(5, 1\)"),
        (np.ones((1, 3), np.int8), np.zeros(5, np.uint16), r"sensors: expected shape \(any, 2\), got \(5,\)"),
        (
            np.ones((1, 3), np.int8),
            np.full((5, 2), 1024, np.uint16),
            r"sensors: expected wire values 0..1023, got 1024",
        ),
    ],
)
def test_what_compiled_code_would_trust_is_checked(weights: Weights, sensors: NDArray[np.uint16], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        recompute(weights, NetworkSize(2, 0, 1), Dynamics(), sensors)

"""SCEANN-Q10: the check values of its specification, exhaustively, and its two readings."""

from __future__ import annotations

import binascii

import numpy as np
import pytest

from sceann_hil.network.coding import MAX_SOURCES, Coding, NetworkSize
from sceann_hil.network.controller import (
    ARITHMETIC_ID,
    ONE,
    THRESHOLD,
    Controller,
    Dynamics,
    FloatController,
    Neuron,
    quantise_sensors,
    sensors_to_q10,
    sigmoid,
    sigmoid_table,
    state_hash,
)

EVERY_STATE = np.arange(-THRESHOLD, THRESHOLD + 1)


def test_the_table_has_its_check_values() -> None:
    table = sigmoid_table()
    assert binascii.crc32(table.astype("<u2").tobytes()) == 0x2557477E == ARITHMETIC_ID
    assert (table[0], table[64], table[128]) == (0, 512, 1024)
    assert np.array_equal(table[:129] + table[:129][::-1], np.full(129, ONE))


def test_all_16385_states_of_the_sigmoid_have_their_check_value() -> None:
    outputs = sigmoid(EVERY_STATE)
    assert binascii.crc32(outputs.astype("<u2").tobytes()) == 0x83FC97A0
    assert np.all(np.diff(outputs) >= 0)
    exact = ONE / (1 + np.exp(-EVERY_STATE / ONE))
    assert np.abs(outputs - exact).max() < 1.0


def test_every_sensor_value_maps_symmetrically_about_mid_scale() -> None:
    q = sensors_to_q10(np.arange(1024))
    assert (q[0], q[511], q[512], q[1023]) == (0, 511, 513, 1024)
    assert np.array_equal(q + q[::-1], np.full(1024, ONE))


def test_sensors_are_rounded_to_ten_bits_and_clipped() -> None:
    assert quantise_sensors([-1.0, 0.0, 0.5, 1.0, 2.0]).tolist() == [0, 0, 512, 1023, 1023]


def test_the_state_hash_has_its_check_value() -> None:
    digits = np.frombuffer(b"12345678", "<i2")
    assert binascii.crc_hqx(b"9", state_hash(digits)) == 0x29B1


def test_no_sum_of_the_largest_network_overflows() -> None:
    size = NetworkSize(20, 2, 1)
    assert size.n_sources == MAX_SOURCES
    ones = np.ones((size.n_neurons, size.n_sources), np.int8)
    controller = Controller(ones, size)
    for _ in range(50):
        controller.step(np.full(20, 1023))
        assert np.abs(controller.u.astype(int)).max() <= THRESHOLD


def test_a_neuron_accumulates_and_is_reset_beyond_the_threshold() -> None:
    size = NetworkSize(1, 0, 1)
    controller = Controller(np.array([[1, 0]]), size)
    states = []
    for _ in range(9):
        controller.step([1023])
        states.append(int(controller.u[0]))
    assert states == [1024, 2048, 3072, 4096, 5120, 6144, 7168, 8192, 0]
    assert controller.x[0] == ONE // 2


def test_a_memoryless_neuron_forgets_and_outputs_0_beyond_the_threshold() -> None:
    size = NetworkSize(9, 0, 1)
    controller = Controller(np.array([[1] * 9 + [0]]), size, Dynamics(Neuron.MEMORYLESS))
    assert controller.step([1023] * 8 + [0]).tolist() == [int(sigmoid(8192))]
    assert controller.step([1023] * 9).tolist() == [0]
    assert controller.u.tolist() == [0]


def test_all_neurons_are_updated_at_once_from_the_current_sensors() -> None:
    size = NetworkSize(1, 1, 1)
    controller = Controller(np.array([[1, 0, 0], [0, 1, 0]]), size, Dynamics(initial_output=100))
    controller.step([1023])
    assert controller.u.tolist() == [1024, 100]


@pytest.mark.parametrize("neuron", Neuron)
@pytest.mark.parametrize("coding", Coding)
def test_the_float_reference_agrees_until_a_threshold_decides_otherwise(coding: Coding, neuron: Neuron) -> None:
    rng = np.random.default_rng(5)
    size, dynamics = NetworkSize(3, 2, 2), Dynamics(neuron)
    compared = 0
    for _ in range(100):
        weights = coding.decode(rng.integers(0, 2, coding.genome_length(size), dtype=np.uint8), size)
        q10, exact = Controller(weights, size, dynamics), FloatController(weights, size, dynamics)
        for _ in range(12):
            wire = rng.integers(0, 1024, 3)
            q10.step(wire)
            exact.step(sensors_to_q10(wire) / ONE)
            near_threshold = np.abs(np.abs(exact.u) - 8.0).min() < 0.1
            reset_differs = np.any((q10.u == 0) != (exact.u == 0.0))
            if near_threshold or reset_differs:
                break
            assert np.abs(q10.x / ONE - exact.x).max() < 0.02
            compared += 1
    assert compared > 500


def test_wrong_weights_are_refused() -> None:
    with pytest.raises(ValueError, match=r"expected shape \(1, 2\)"):
        Controller(np.zeros((2, 2)), NetworkSize(1, 0, 1))
    with pytest.raises(ValueError, match=r"-1, 0 or \+1"):
        Controller(np.full((1, 2), 2), NetworkSize(1, 0, 1))

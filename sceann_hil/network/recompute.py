"""The neurons of a trial again, from nothing but the sensor values: what the host believes that a robot computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import NetworkSize, Weights
from sceann_hil.network.compiled import compiled
from sceann_hil.network.controller import SENSOR_MAX, Dynamics, Neuron
from sceann_hil.network.neurons import hashed
from sceann_hil.network.single import step_neurons


@dataclass(frozen=True, slots=True)
class Neurons:
    """A network's steps.

    Attributes:
        u: states after each step, int16 Q10, shape ``(n, n_neurons)``.
        x: outputs after each step, int16 Q10, shape ``(n, n_neurons)``; the motors are the last columns.
        hashes: state hash after each step, uint16, shape ``(n,)``.
    """

    u: NDArray[np.int16]
    x: NDArray[np.int16]
    hashes: NDArray[np.uint16]


def recompute(weights: Weights, size: NetworkSize, dynamics: Dynamics, sensors: NDArray[np.uint16]) -> Neurons:
    """Step a network through a trial's sensors.

    Args:
        weights: shape ``(n_neurons, n_sources)``.
        size: the network's size.
        dynamics: the neuron's reading and initial output.
        sensors: wire values 0..1023, shape ``(n, n_sensors)``.

    Raises:
        ValueError: an array has another shape, or a value beyond the wire's.
    """
    _check(weights, size, sensors)
    n = len(sensors)
    neurons = Neurons(
        np.zeros((n, size.n_neurons), np.int16), np.zeros((n, size.n_neurons), np.int16), np.zeros(n, np.uint16)
    )
    _recompute(
        np.ascontiguousarray(weights, np.int8),
        dynamics.neuron is Neuron.MEMORYLESS,
        dynamics.initial_output,
        np.ascontiguousarray(sensors, np.uint16),
        neurons.u,
        neurons.x,
        neurons.hashes,
    )
    return neurons


def _check(weights: Weights, size: NetworkSize, sensors: NDArray[np.uint16]) -> None:
    """Compiled code trusts what it is given."""
    if np.shape(weights) != (size.n_neurons, size.n_sources):
        raise ValueError(f"weights: expected shape {(size.n_neurons, size.n_sources)}, got {np.shape(weights)}")
    if np.ndim(sensors) != 2 or np.shape(sensors)[1] != size.n_sensors:
        raise ValueError(f"sensors: expected shape (any, {size.n_sensors}), got {np.shape(sensors)}")
    if np.size(sensors) and int(np.max(sensors)) > SENSOR_MAX:
        raise ValueError(f"sensors: expected wire values 0..{SENSOR_MAX}, got {int(np.max(sensors))}")


@compiled
def _recompute(
    weights: NDArray[np.int8],
    memoryless: bool,
    initial_output: int,
    sensors: NDArray[np.uint16],
    trace_u: NDArray[np.int16],
    trace_x: NDArray[np.int16],
    hashes: NDArray[np.uint16],
) -> None:
    n_neurons = weights.shape[0]
    now = np.zeros((3, n_neurons), np.int32)
    now[1] = initial_output
    crc = np.uint16(0xFFFF)
    for step in range(sensors.shape[0]):
        step_neurons(weights, now, sensors[step], memoryless)
        for i in range(n_neurons):
            state = np.int16(now[0, i])
            trace_u[step, i] = state
            trace_x[step, i] = np.int16(now[1, i])
            crc = hashed(crc, state)
        hashes[step] = crc

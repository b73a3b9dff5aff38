"""The neurons of a trial again, from nothing but the sensor values: what the host believes that a robot computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import NetworkSize, Weights
from sceann_hil.network.compiled import compiled
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.network.neurons import LANES, update_hashes, update_outputs, update_states


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
    """
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
    n_neurons, n_sources = weights.shape
    n_sensors = n_sources - n_neurons
    lane_weights = np.zeros((n_neurons, n_sources, LANES), np.int16)
    sources = np.zeros((n_sources, LANES), np.int16)
    outputs = sources[n_sensors:]
    u = np.zeros((n_neurons, LANES), np.int16)
    resets = np.zeros((n_neurons, LANES), np.int16)
    lane_hashes = np.full(LANES, 0xFFFF, np.uint16)
    for i in range(n_neurons):
        outputs[i] = initial_output
        for j in range(n_sources):
            lane_weights[i, j] = weights[i, j]
    for step in range(sensors.shape[0]):
        for j in range(n_sensors):
            r = np.int32(sensors[step, j])
            sources[j] = np.int16(r + (r >> np.int32(9)))
        update_states(u, resets, lane_weights, sources, memoryless)
        update_outputs(u, resets, outputs, memoryless)
        update_hashes(u, lane_hashes)
        for i in range(n_neurons):
            trace_u[step, i] = u[i, 0]
            trace_x[step, i] = outputs[i, 0]
        hashes[step] = lane_hashes[0]

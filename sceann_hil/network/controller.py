"""The neuron: SCEANN-Q10 (integers, the same bits everywhere) and a float64 reference.

Source: ``docs/arithmetic.md`` (our specification) and Katada & Nakazawa, Section II.A, Eq. (1) and (2). These two
classes are the readable definition. The compiled simulation kernel, the C firmware and exported headers are held
against them bit for bit.
"""

from __future__ import annotations

import binascii
from dataclasses import dataclass
from decimal import Decimal, localcontext
from enum import StrEnum
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sceann_hil.network.coding import NetworkSize, Weights

ONE = 1024
"""1.0 in Q10."""
THRESHOLD = 8 * ONE
"""Refractory threshold x_c = 8 in Q10: a state beyond it is reset to 0."""
SENSOR_MAX = 1023
"""Largest sensor value on the wire (10 bits)."""
ARITHMETIC_ID = 0x2557477E
"""CRC-32 of the sigmoid table: what robot and host compare before they work together."""


class Neuron(StrEnum):
    """How Eq. (1) is read."""

    ACCUMULATING = "accumulating"
    """The state adds up its inputs: ``u += net``; a reset neuron outputs f(0) = 0.5."""
    MEMORYLESS = "memoryless"
    """Eq. (1) to the letter: ``u = net``; a neuron beyond the threshold outputs 0."""


@dataclass(frozen=True, slots=True)
class Dynamics:
    """What a network does besides its weights.

    Attributes:
        neuron: the reading of Eq. (1).
        initial_output: x_i(0) in Q10, 0..1024; 512 (= f(0)) unless a study asks otherwise.
    """

    neuron: Neuron = Neuron.ACCUMULATING
    initial_output: int = ONE // 2

    def __post_init__(self) -> None:
        if not 0 <= self.initial_output <= ONE:
            raise ValueError(f"initial_output: expected 0..{ONE} (Q10), got {self.initial_output}")


@cache
def sigmoid_table() -> NDArray[np.int16]:
    """T[k] = floor(1024 sigma((k - 64) / 8) + 1/2) for k = 0..128 and T[129] = T[128].

    Made with decimal arithmetic, so that no C library's ``exp`` decides a bit. Read-only, shape ``(130,)``.
    """
    with localcontext() as context:
        context.prec = 50
        nodes = [int(Decimal(ONE) / (1 + (-(Decimal(k) - 64) / 8).exp()) + Decimal("0.5")) for k in range(129)]
    table: NDArray[np.int16] = np.array([*nodes, nodes[-1]], dtype=np.int16)
    table.flags.writeable = False
    return table


def sigmoid(state: ArrayLike) -> NDArray[np.int16]:
    """f(u) in Q10 by linear interpolation in `sigmoid_table`; any shape, states -8192..8192."""
    z = np.asarray(state, dtype=np.int32) + THRESHOLD
    node, fraction = z >> 7, z & 127
    table = sigmoid_table().astype(np.int32)
    rise = ((table[node + 1] - table[node]) * fraction + 64) >> 7
    return np.asarray(table[node] + rise, dtype=np.int16)


def quantise_sensors(values: ArrayLike) -> NDArray[np.uint16]:
    """Sensor values in [0, 1] as 10-bit wire values 0..1023: r = floor(1023 s + 1/2)."""
    clipped = np.clip(np.asarray(values, dtype=np.float64), 0.0, 1.0)
    return np.floor(SENSOR_MAX * clipped + 0.5).astype(np.uint16)


def sensors_to_q10(wire: ArrayLike) -> NDArray[np.int16]:
    """Wire values 0..1023 as Q10 values 0..1024, with mid-scale symmetric about 512: q = r + (r >> 9)."""
    r = np.asarray(wire, dtype=np.int16)
    return (r + (r >> 9)).astype(np.int16)


class Controller:
    """One network in SCEANN-Q10, stepped with wire values.

    Attributes:
        u: neuron states, int16 Q10, shape ``(n_neurons,)``, -8192..8192.
        x: neuron outputs, int16 Q10, shape ``(n_neurons,)``, 0..1024; hidden neurons first, then motors.
    """

    def __init__(self, weights: Weights, size: NetworkSize, dynamics: Dynamics = Dynamics()) -> None:
        self.size = size
        self.dynamics = dynamics
        self._weights = _checked(weights, size)
        self.reset()

    def reset(self) -> None:
        """Back to the state before the first step of a trial."""
        self.u = np.zeros(self.size.n_neurons, np.int16)
        self.x = np.full(self.size.n_neurons, self.dynamics.initial_output, np.int16)

    def step(self, wire: ArrayLike) -> NDArray[np.int16]:
        """One control step, all neurons at once.

        Args:
            wire: the current sensors, 0..1023, shape ``(n_sensors,)``.

        Returns:
            Motor outputs, int16 Q10, shape ``(n_motors,)``, 0..1024.
        """
        sources = np.concatenate([sensors_to_q10(wire), self.x])
        net = (self._weights * sources).sum(axis=1, dtype=np.int16)
        accumulating = self.dynamics.neuron is Neuron.ACCUMULATING
        u = self.u + net if accumulating else net
        reset = np.abs(u) > THRESHOLD
        self.u = np.where(reset, 0, u).astype(np.int16)
        self.x = sigmoid(self.u)
        if not accumulating:
            self.x[reset] = 0
        return self.x[self.size.n_hidden :]


class FloatController:
    """The same network in float64 with the true sigmoid: a cross-check, never the reference for bits.

    Attributes:
        u: neuron states, shape ``(n_neurons,)``, -8..8.
        x: neuron outputs, shape ``(n_neurons,)``, 0..1.
    """

    def __init__(self, weights: Weights, size: NetworkSize, dynamics: Dynamics = Dynamics()) -> None:
        self.size = size
        self.dynamics = dynamics
        self._weights = _checked(weights, size).astype(np.float64)
        self.reset()

    def reset(self) -> None:
        """Back to the state before the first step of a trial."""
        self.u = np.zeros(self.size.n_neurons)
        self.x = np.full(self.size.n_neurons, self.dynamics.initial_output / ONE)

    def step(self, sensors: ArrayLike) -> NDArray[np.float64]:
        """One control step from sensors in [0, 1], shape ``(n_sensors,)``; motor outputs in [0, 1]."""
        net = self._weights @ np.concatenate([np.asarray(sensors, dtype=np.float64), self.x])
        accumulating = self.dynamics.neuron is Neuron.ACCUMULATING
        u = self.u + net if accumulating else net
        reset = np.abs(u) > THRESHOLD / ONE
        self.u = np.where(reset, 0.0, u)
        self.x = 1.0 / (1.0 + np.exp(-self.u))
        if not accumulating:
            self.x[reset] = 0.0
        return self.x[self.size.n_hidden :]


def state_hash(states: ArrayLike, crc: int = 0xFFFF) -> int:
    """CRC-16 (polynomial 0x1021) over neuron states as little-endian int16, in the order they arose.

    Args:
        states: int16, shape ``(n_steps, n_neurons)`` or ``(n_neurons,)``.
        crc: the hash so far, so that a trial can be hashed step by step.
    """
    return binascii.crc_hqx(np.asarray(states).astype("<i2").tobytes(), crc)


def _checked(weights: Weights, size: NetworkSize) -> NDArray[np.int16]:
    weights = np.asarray(weights)
    if weights.shape != (size.n_neurons, size.n_sources):
        raise ValueError(f"weights: expected shape ({size.n_neurons}, {size.n_sources}), got {weights.shape}")
    if np.abs(weights).max(initial=0) > 1:
        raise ValueError("weights: expected -1, 0 or +1 everywhere")
    return weights.astype(np.int16)

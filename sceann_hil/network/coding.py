"""SCEANN1, SCEANN2 and SCEANN3: a bit string and the signed connection matrix it codes.

Source: Katada & Nakazawa, Section II.B to II.D and Figure 3. A genome is a series of blocks, one for each hidden
and motor neuron (hidden neurons first). Inside a block the sources stand in the order sensors, hidden, motors.
Bit 1 means a positive sign, and bit 1 means that the connection is present.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

Bits = NDArray[np.uint8]
"""Genomes as arrays of 0 and 1, shape ``(..., L)``."""

Weights = NDArray[np.int8]
"""Connection matrices with entries -1, 0, +1, shape ``(..., n_neurons, n_sources)``."""

MAX_SOURCES = 23
"""Largest ``n_sources`` for which no sum of SCEANN-Q10 leaves int16 (8192 + 23 * 1024 = 31744)."""


@dataclass(frozen=True, slots=True)
class NetworkSize:
    """Numbers of sensor, hidden and motor neurons.

    Raises:
        ValueError: a number is out of range, or the network has more than `MAX_SOURCES` sources.
    """

    n_sensors: int
    n_hidden: int
    n_motors: int

    def __post_init__(self) -> None:
        for name, least in (("n_sensors", 1), ("n_hidden", 0), ("n_motors", 1)):
            value = getattr(self, name)
            if value < least:
                raise ValueError(f"{name}: expected at least {least}, got {value}")
        if self.n_sources > MAX_SOURCES:
            raise ValueError(
                f"n_sensors + n_hidden + n_motors: expected at most {MAX_SOURCES} sources "
                f"(a larger sum could overflow the 16-bit neuron), "
                f"got {self.n_sensors} + {self.n_hidden} + {self.n_motors} = {self.n_sources}"
            )

    def check_fits(self, n_sensors: int, n_motors: int, whom: str) -> None:
        """Refuse a network that a body cannot feed or obey: the one place that says what fits what.

        Raises:
            ValueError: the body has other numbers of sensors and motors.
        """
        if (self.n_sensors, self.n_motors) != (n_sensors, n_motors):
            raise ValueError(
                f"network: expected {n_sensors} sensors and {n_motors} motors for {whom}, "
                f"got {self.n_sensors} and {self.n_motors}"
            )

    @property
    def n_neurons(self) -> int:
        """Neurons that compute: hidden and motor neurons, in this order."""
        return self.n_hidden + self.n_motors

    @property
    def n_sources(self) -> int:
        """What every neuron may listen to: sensors, hidden and motor neurons, in this order."""
        return self.n_sensors + self.n_hidden + self.n_motors

    @property
    def sensor_names(self) -> tuple[str, ...]:
        """For people: s1, s2, ..."""
        return tuple(f"s{i + 1}" for i in range(self.n_sensors))

    @property
    def hidden_names(self) -> tuple[str, ...]:
        """For people: h1, h2, ..."""
        return tuple(f"h{i + 1}" for i in range(self.n_hidden))

    @property
    def motor_names(self) -> tuple[str, ...]:
        """For people: m1, m2, ..."""
        return tuple(f"m{i + 1}" for i in range(self.n_motors))

    @property
    def neuron_names(self) -> tuple[str, ...]:
        """Hidden and motor neurons: the rows of a connection matrix."""
        return self.hidden_names + self.motor_names

    @property
    def source_names(self) -> tuple[str, ...]:
        """Sensors, hidden and motor neurons: the columns of a connection matrix."""
        return self.sensor_names + self.neuron_names


class Coding(Enum):
    """How a bit string codes the connections of one neuron's block."""

    SCEANN1 = "sceann1"
    """One sign bit for the whole block, then one presence bit per source."""
    SCEANN2 = "sceann2"
    """All sign bits of the block, then all presence bits."""
    SCEANN3 = "sceann3"
    """One sign bit per source; every connection is present."""

    def block_length(self, size: NetworkSize) -> int:
        """Bits that code one neuron."""
        match self:
            case Coding.SCEANN1:
                return 1 + size.n_sources
            case Coding.SCEANN2:
                return 2 * size.n_sources
            case Coding.SCEANN3:
                return size.n_sources

    def genome_length(self, size: NetworkSize) -> int:
        """L, the number of bits of a genome (Section II, the three length formulas)."""
        return size.n_neurons * self.block_length(size)

    def decode(self, genome: Bits, size: NetworkSize) -> Weights:
        """Connection matrices of one or many genomes.

        Args:
            genome: bits, shape ``(..., L)``.
            size: the network that the bits code.

        Returns:
            Weights, shape ``(..., n_neurons, n_sources)``.

        Raises:
            ValueError: the last axis is not `genome_length` long.
        """
        genome = np.asarray(genome, dtype=np.uint8)
        length = self.genome_length(size)
        if genome.shape[-1:] != (length,):
            raise ValueError(f"genome: expected {length} bits for {self.value} with {size}, got shape {genome.shape}")
        blocks = genome.reshape(*genome.shape[:-1], size.n_neurons, self.block_length(size)).astype(np.int8)
        n = size.n_sources
        match self:
            case Coding.SCEANN1:
                return (2 * blocks[..., :1] - 1) * blocks[..., 1:]
            case Coding.SCEANN2:
                return (2 * blocks[..., :n] - 1) * blocks[..., n:]
            case Coding.SCEANN3:
                return 2 * blocks - 1

    def encode(self, weights: Weights, size: NetworkSize) -> Bits:
        """A genome that decodes to `weights`; bits that do not matter are 0.

        Args:
            weights: shape ``(..., n_neurons, n_sources)``.
            size: the network's size.

        Returns:
            Bits, shape ``(..., L)``.

        Raises:
            ValueError: the shape does not fit, or this coding cannot express these weights.
        """
        weights = np.asarray(weights, dtype=np.int8)
        if weights.shape[-2:] != (size.n_neurons, size.n_sources):
            raise ValueError(f"weights: expected shape (..., {size.n_neurons}, {size.n_sources}), got {weights.shape}")
        positive, present = weights > 0, weights != 0
        match self:
            case Coding.SCEANN1:
                sign = positive.any(-1, keepdims=True)
                blocks = np.concatenate([sign, present], -1)
            case Coding.SCEANN2:
                blocks = np.concatenate([positive, present], -1)
            case Coding.SCEANN3:
                blocks = positive
        genome = blocks.reshape(*weights.shape[:-2], self.genome_length(size)).astype(np.uint8)
        if not np.array_equal(self.decode(genome, size), weights):
            raise ValueError(f"weights: {self.value} cannot express this matrix")
        return genome


def genome_to_hex(genome: Bits) -> str:
    """One genome as hexadecimal text, first bit first, padded with zero bits to whole bytes."""
    return np.packbits(np.asarray(genome, dtype=np.uint8)).tobytes().hex()


def genomes_to_hex(genomes: Bits) -> list[str]:
    """Each of some genomes, shape ``(n, L)``, as `genome_to_hex` writes it."""
    packed = np.packbits(np.asarray(genomes, dtype=np.uint8), axis=1)
    text, width = packed.tobytes().hex(), 2 * packed.shape[1]
    return (
        [text[first : first + width] for first in range(0, width * len(packed), width)] if width else [""] * len(packed)
    )


def genome_from_hex(text: str, length: int) -> Bits:
    """The inverse of `genome_to_hex`.

    Raises:
        ValueError: not hexadecimal, or not the number of bytes that `length` bits need.
    """
    raw = bytes.fromhex(text)
    if len(raw) != (length + 7) // 8:
        raise ValueError(f"genome: expected {(length + 7) // 8} bytes for {length} bits, got {len(raw)}")
    return np.unpackbits(np.frombuffer(raw, dtype=np.uint8))[:length]

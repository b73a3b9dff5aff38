"""One evolved controller, with everything that export, flash and verify need to know about it."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field

import numpy as np

from sceann_hil.network.coding import Bits, Coding, NetworkSize, Weights
from sceann_hil.network.controller import Controller, Dynamics, Neuron

CODING_NUMBER = {Coding.SCEANN1: 1, Coding.SCEANN2: 2, Coding.SCEANN3: 3}
NEURON_NUMBER = {Neuron.ACCUMULATING: 0, Neuron.MEMORYLESS: 1}


@dataclass(frozen=True, slots=True, eq=False)
class ControllerImage:
    """A genome and what it takes to make the same controller of it anywhere.

    Attributes:
        genome: bits, shape ``(L,)``.
        coding: how the bits code connections.
        size: the network's size.
        dynamics: the neuron's reading and initial output.
        fitness: what it reached, in the run's unit; None if it never ran.
        provenance: the command that makes this controller's header again, without machine paths.

    Raises:
        ValueError: the genome has not the length that coding and size ask for.
    """

    genome: Bits
    coding: Coding
    size: NetworkSize
    dynamics: Dynamics = field(default_factory=Dynamics)
    fitness: float | None = None
    provenance: str = ""

    def __post_init__(self) -> None:
        self.coding.decode(self.genome, self.size)

    @property
    def weights(self) -> Weights:
        """Connection matrix, int8, shape ``(n_neurons, n_sources)``."""
        return self.coding.decode(self.genome, self.size)

    def controller(self) -> Controller:
        """The reference controller."""
        return Controller(self.weights, self.size, self.dynamics)

    @property
    def header(self) -> bytes:
        """The first seven bytes of the genome record: the arguments of LOAD."""
        return struct.pack(
            "<5BH",
            CODING_NUMBER[self.coding],
            NEURON_NUMBER[self.dynamics.neuron],
            self.size.n_sensors,
            self.size.n_hidden,
            self.size.n_motors,
            len(self.genome),
        )

    @property
    def packed_genome(self) -> bytes:
        """The bits, first bit in the highest bit of the first byte."""
        return np.packbits(self.genome).tobytes()

    @property
    def record(self) -> bytes:
        """The genome record of ``docs/link.md``: what is uploaded, stored and checked."""
        return self.header + struct.pack("<H", self.dynamics.initial_output) + self.packed_genome

    @property
    def record_crc(self) -> int:
        """CRC-32 of the genome record."""
        return zlib.crc32(self.record)

    @property
    def weights_crc(self) -> int:
        """CRC-32 of the decoded weights as int8 in row order: what COMMIT answers."""
        return zlib.crc32(self.weights.astype(np.int8).tobytes())

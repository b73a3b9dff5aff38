"""How a genome becomes a controller."""

from __future__ import annotations

from dataclasses import dataclass

from sceann_hil.network.coding import Bits, Coding, NetworkSize, Weights
from sceann_hil.network.controller import Dynamics


@dataclass(frozen=True, slots=True)
class Phenotype:
    """Coding, network and neuron: what genomes and weights mean, the same for a whole run.

    Attributes:
        coding: how bits become weights.
        size: the network's size.
        dynamics: the neuron's reading.
    """

    coding: Coding
    size: NetworkSize
    dynamics: Dynamics

    @property
    def genome_length(self) -> int:
        """L, bits of a genome."""
        return self.coding.genome_length(self.size)

    def decode(self, genomes: Bits) -> Weights:
        """Weights of genomes: bits, shape ``(..., L)``, to int8, shape ``(..., n_neurons, n_sources)``."""
        return self.coding.decode(genomes, self.size)

"""The simple genetic algorithm: tournament selection, elitism and bit mutation, no crossover.

Source: Katada & Nakazawa, Section IV: population 25, 50 generations, tournament 2, elitism 1, mutation rate
1/L.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sceann_hil.evolution.algorithm import State
from sceann_hil.evolution.dumping import Header, Reader, checked_parents, pack_bits, read_only
from sceann_hil.evolution.generational import GenerationalAlgorithm, GenerationalConfig
from sceann_hil.network.coding import Bits

_VERSION = 1


class SGAConfig(GenerationalConfig):
    """Settings of the simple genetic algorithm."""

    type: Literal["sga"] = "sga"

    def build(self, genome_length: int) -> SGA:
        """The algorithm for genomes of `genome_length` bits."""
        return SGA(genome_length, self)


class SGA(GenerationalAlgorithm[State]):
    """The simple genetic algorithm; the defaults are the paper's.

    Args:
        genome_length: L, bits per genome.
        config: its settings.

    Raises:
        ValueError: genomes of such a length cannot be.
    """

    def __init__(self, genome_length: int, config: SGAConfig = SGAConfig()) -> None:  # noqa: B008
        super().__init__(genome_length, config)
        self._header = Header("SGA", _VERSION, 1, config.population, genome_length)

    def start(self, rng: np.random.Generator) -> State:
        """Independent fair bits."""
        genomes = rng.integers(0, 2, size=(self.population, self.genome_length), dtype=np.uint8)
        return State(read_only(genomes), read_only(np.full(self.population, -1, dtype=np.int32)))

    def adopt(self, genomes: Bits, rng: np.random.Generator) -> State:
        """The genomes as they are."""
        return State(read_only(self._filled(genomes)), read_only(np.full(self.population, -1, dtype=np.int32)))

    def tell(self, state: State, fitness: NDArray[np.float64], rng: np.random.Generator) -> State:
        """The elites first and unmutated, then the children."""
        # Numba takes a third of a second to import, and listing or checking a config needs none of it.
        from sceann_hil.evolution.sga_generation import next_generation

        self._check_genomes(state.genomes.shape)
        genomes, parents = next_generation(
            state.genomes,
            self._checked_fitness(fitness),
            self.tournament,
            self.mutation_rate,
            self.elites,
            rng,
        )
        return State(read_only(genomes), read_only(parents))

    def dump(self, state: State) -> bytes:
        """Header, genomes (packed bits), parents (int32)."""
        self._check_genomes(state.genomes.shape)
        return self._header.pack() + pack_bits(state.genomes) + state.parents.astype("<i4").tobytes()

    def load(self, data: bytes) -> State:
        """The inverse of `dump`."""
        reader = Reader(data, self._header)
        genomes = reader.bits((self.population, self.genome_length))
        parents = checked_parents(reader.array("<i4", (self.population,)))
        reader.finish()
        return State(read_only(genomes), read_only(parents))

"""Random search: the honest baseline. Whatever does not beat it has learned nothing."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sceann_hil.evolution.algorithm import Algorithm, State
from sceann_hil.evolution.checks import check_shape, checked_fitness, filled_population
from sceann_hil.evolution.dumping import Header, Reader, checked_parents, pack_bits, read_only
from sceann_hil.network.coding import Bits
from sceann_hil.plugins import AlgorithmConfig

_VERSION = 1


class RandomSearchConfig(AlgorithmConfig):
    """Settings of the random search."""

    compares_only: ClassVar[bool] = True

    type: Literal["random"] = "random"
    population: Annotated[int, Field(ge=2, le=100_000)] = 25
    """Individuals per generation."""
    generations: Annotated[int, Field(ge=0, le=10_000_000)] = 50
    """Generations after the initial one, so one more is evaluated."""
    elites: Annotated[int, Field(ge=0)] = 1
    """Best individuals that stay; fewer than population."""

    @property
    def keeps_best(self) -> bool:
        return self.elites > 0

    @model_validator(mode="after")
    def _elites_leave_room(self) -> Self:
        if self.elites >= self.population:
            raise ValueError(f"elites: expected fewer than population ({self.population}), got {self.elites}")
        return self

    def build(self, genome_length: int) -> RandomSearch:
        """The algorithm for genomes of `genome_length` bits."""
        return RandomSearch(genome_length, self)


class RandomSearch(Algorithm[State]):
    """Fresh random genomes in every generation; only the elites stay.

    Args:
        genome_length: L, bits per genome.
        config: its settings; of equals the first are kept.
    """

    def __init__(self, genome_length: int, config: RandomSearchConfig = RandomSearchConfig()) -> None:  # noqa: B008
        self.genome_length = genome_length
        self.population = config.population
        self.elites = config.elites
        self._header = Header("RND", _VERSION, 1, config.population, genome_length)

    def start(self, rng: np.random.Generator) -> State:
        """Independent fair bits."""
        return self._state(self._bits(self.population, rng), np.full(self.population, -1, np.int32))

    def adopt(self, genomes: Bits, rng: np.random.Generator) -> State:
        """The genomes as they are."""
        filled = filled_population(genomes, self.population, self.genome_length)
        return self._state(filled, np.full(self.population, -1, np.int32))

    def tell(self, state: State, fitness: NDArray[np.float64], rng: np.random.Generator) -> State:
        """The elites, then random genomes without parents."""
        check_shape(state.genomes.shape, self.population, self.genome_length)
        best = np.argsort(-checked_fitness(fitness, self.population), kind="stable")[: self.elites]
        fresh = self._bits(self.population - self.elites, rng)
        parents = np.full(self.population, -1, np.int32)
        parents[: self.elites] = best
        return self._state(np.concatenate([state.genomes[best], fresh]), parents)

    def dump(self, state: State) -> bytes:
        """Header, genomes (packed bits), parents (int32)."""
        check_shape(state.genomes.shape, self.population, self.genome_length)
        return self._header.pack() + pack_bits(state.genomes) + state.parents.astype("<i4").tobytes()

    def load(self, data: bytes) -> State:
        """The inverse of `dump`."""
        reader = Reader(data, self._header)
        genomes = reader.bits((self.population, self.genome_length))
        parents = checked_parents(reader.array("<i4", (self.population,)))
        reader.finish()
        return self._state(genomes, parents)

    def _bits(self, count: int, rng: np.random.Generator) -> Bits:
        return rng.integers(0, 2, size=(count, self.genome_length), dtype=np.uint8)

    @staticmethod
    def _state(genomes: Bits, parents: NDArray[np.int32]) -> State:
        return State(read_only(np.ascontiguousarray(genomes)), read_only(parents))

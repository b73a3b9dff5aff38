"""Any library that asks and tells over bits, as an algorithm of ours: its state goes through the journal as bytes."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sceann_hil.evolution.algorithm import Algorithm, State
from sceann_hil.evolution.checks import check_shape, checked_fitness, checked_measures, filled_population
from sceann_hil.evolution.dumping import Header, Reader, checked_parents, pack_bits, read_only
from sceann_hil.network.coding import Bits

_VERSION = 1


class Optimiser(Protocol):
    """What a library brings. It maximises, or its wrapper turns the sign."""

    def ask(self) -> ArrayLike:
        """Genomes of 0 and 1, shape ``(population, L)``."""

    def tell(self, genomes: Bits, fitness: NDArray[np.float64]) -> Any:
        """What these genomes reached, float64, shape ``(population,)``."""


@dataclass(frozen=True, slots=True)
class WrappedState(State):
    """One generation of a wrapped library.

    Attributes:
        optimiser: all that the library needs to be told of this generation, as `AskTellAlgorithm.save` wrote it.
    """

    optimiser: bytes


class AskTellAlgorithm(Algorithm[WrappedState]):
    """A wrapper around an `Optimiser`. A subclass says how one is made, saved and restored.

    Bytes in a journal may come from anybody: `restore` must not run code that is in them (no pickle).

    Args:
        genome_length: L, bits per genome.
        population: genomes per `Optimiser.ask`.
        name: up to 4 letters that tell this algorithm's states from others'.
    """

    def __init__(self, genome_length: int, population: int, name: str) -> None:
        self.genome_length = genome_length
        self.population = population
        self._header = Header(name, _VERSION, 1, population, genome_length)

    @abstractmethod
    def make(self, rng: np.random.Generator) -> Optimiser:
        """A fresh one. All that it draws comes from `rng`."""

    @abstractmethod
    def save(self, optimiser: Optimiser) -> bytes:
        """What it knows, without its random state; equal ones give equal bytes."""

    @abstractmethod
    def restore(self, data: bytes, rng: np.random.Generator) -> Optimiser:
        """The one that `save` wrote. All that it draws from now on comes from `rng`.

        Raises:
            ValueError: `save` did not write this.
        """

    def start(self, rng: np.random.Generator) -> WrappedState:
        """What a fresh optimiser asks for."""
        return self._asked(self.make(rng))

    def adopt(self, genomes: Bits, rng: np.random.Generator) -> WrappedState:
        """The genomes as they are, which a fresh optimiser is then told of."""
        filled = filled_population(genomes, self.population, self.genome_length)
        return self._state(filled, self.save(self.make(rng)))

    def tell(self, state: WrappedState, fitness: NDArray[np.float64], rng: np.random.Generator) -> WrappedState:
        """What the optimiser asks for, once it was told of this generation."""
        check_shape(state.genomes.shape, self.population, self.genome_length)
        checked = checked_fitness(fitness, self.population)
        optimiser = self.restore(state.optimiser, rng)
        optimiser.tell(state.genomes, checked)
        return self._asked(optimiser)

    def tell_with_measures(
        self,
        state: WrappedState,
        fitness: NDArray[np.float64],
        measures: NDArray[np.float64],
        rng: np.random.Generator,
    ) -> WrappedState:
        """As `tell`; an optimiser with ``tell_with_measures(genomes, fitness, measures)`` is told these too."""
        optimiser = self.restore(state.optimiser, rng)
        told = getattr(optimiser, "tell_with_measures", None)
        if told is None:
            return self.tell(state, fitness, rng)
        check_shape(state.genomes.shape, self.population, self.genome_length)
        values = np.asarray(measures)
        told(
            state.genomes,
            checked_fitness(fitness, self.population),
            checked_measures(values, self.population, values.shape[-1] if values.ndim else 0),
        )
        return self._asked(optimiser)

    def dump(self, state: WrappedState) -> bytes:
        """Header, genomes (packed bits), parents (int32), length of the optimiser's bytes (uint32), the bytes."""
        check_shape(state.genomes.shape, self.population, self.genome_length)
        size = np.array([len(state.optimiser)], "<u4").tobytes()
        parents = state.parents.astype("<i4").tobytes()
        return self._header.pack() + pack_bits(state.genomes) + parents + size + state.optimiser

    def load(self, data: bytes) -> WrappedState:
        """The inverse of `dump`."""
        reader = Reader(data, self._header)
        genomes = reader.bits((self.population, self.genome_length))
        checked_parents(reader.array("<i4", (self.population,)))
        size = int(reader.array("<u4", (1,))[0])
        optimiser = reader.array("u1", (size,)).tobytes()
        reader.finish()
        self.restore(optimiser, np.random.default_rng(0))
        return self._state(genomes, optimiser)

    def _asked(self, optimiser: Optimiser) -> WrappedState:
        genomes = np.asarray(optimiser.ask())
        if genomes.shape != (self.population, self.genome_length) or not np.isin(genomes, (0, 1)).all():
            raise ValueError(
                f"ask: expected {self.population} genomes of {self.genome_length} bits, got shape {genomes.shape} "
                f"with values {np.unique(genomes)[:5].tolist()}"
            )
        return self._state(genomes.astype(np.uint8), self.save(optimiser))

    def _state(self, genomes: Bits, optimiser: bytes) -> WrappedState:
        nobody = np.full(self.population, -1, np.int32)
        return WrappedState(read_only(np.ascontiguousarray(genomes)), read_only(nobody), optimiser)

"""What every genetic algorithm is to the rest of the framework: state in, state out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Bits


@dataclass(frozen=True, slots=True)
class State:
    """One generation: everything an algorithm needs to make the next one. Arrays are read-only.

    Attributes:
        genomes: expressed bits, uint8, shape ``(population, L)``.
        parents: index of each individual's parent in the generation before, int32, shape ``(population,)``;
            -1 in the first generation.
    """

    genomes: Bits
    parents: NDArray[np.int32]


@dataclass(frozen=True, slots=True)
class Archive:
    """Different good controllers, one for each filled cell of a grid over what they do (e elites, k axes).

    Attributes:
        names: of the axes' measures, with units.
        ranges: lowest and highest value of each axis.
        cells: number of cells along each axis.
        places: cell of each elite along each axis, int64, shape ``(e, k)``.
        genomes: bits, uint8, shape ``(e, L)``.
        fitness: float64, shape ``(e,)``.
        measures: float64, shape ``(e, k)``.
    """

    names: tuple[str, ...]
    ranges: tuple[tuple[float, float], ...]
    cells: tuple[int, ...]
    places: NDArray[np.int64]
    genomes: Bits
    fitness: NDArray[np.float64]
    measures: NDArray[np.float64]

    @property
    def grid(self) -> NDArray[np.float64]:
        """Fitness by cell, NaN where it is empty, shape `cells`."""
        grid = np.full(self.cells, np.nan)
        grid[tuple(self.places.T)] = self.fitness
        return grid

    @property
    def plane(self) -> NDArray[np.float64]:
        """`grid` over the first two axes, the best of all further ones, shape ``(cells, cells)``; one axis is a row."""
        grid = self.grid.reshape(*self.cells[:2], -1) if len(self.cells) > 1 else self.grid[:, None, None]
        best = np.where(np.isnan(grid), -np.inf, grid).max(axis=2)
        return np.where(np.isinf(best), np.nan, best)


StateT = TypeVar("StateT", bound=State)


class Algorithm(ABC, Generic[StateT]):
    """A generational algorithm that maximises.

    The caller holds the state and the Generator::

        state = algorithm.start(rng)
        while ...:
            fitness = evaluate(algorithm.ask(state))
            state = algorithm.tell(state, fitness, rng)
    """

    attended: ClassVar[bool] = False
    """It is told of people's time, see `tell_attended`."""

    @abstractmethod
    def start(self, rng: np.random.Generator) -> StateT:
        """The first generation."""

    @abstractmethod
    def adopt(self, genomes: Bits, rng: np.random.Generator) -> StateT:
        """A first generation of given genomes, such as those of another run.

        Args:
            genomes: bits, shape ``(n, L)``; taken in turn until the population is full, the rest is left out.
            rng: for whatever else an individual has.

        Raises:
            ValueError: another L.
        """

    def ask(self, state: StateT) -> Bits:
        """The genomes to evaluate, shape ``(population, L)``."""
        return state.genomes

    @abstractmethod
    def tell(self, state: StateT, fitness: NDArray[np.float64], rng: np.random.Generator) -> StateT:
        """The generation after `state`, whose individuals reached `fitness` (shape ``(population,)``).

        Raises:
            ValueError: wrong shape, or a fitness that is not a number (a failed trial is never a number).
        """

    def tell_with_measures(
        self,
        state: StateT,
        fitness: NDArray[np.float64],
        measures: NDArray[np.float64],
        rng: np.random.Generator,
    ) -> StateT:
        """As `tell`, with more than one number for each individual.

        Only algorithms whose configuration names `measures` are told them; the default ignores them.

        Args:
            state: as in `tell`.
            fitness: as in `tell`.
            measures: mean over each individual's trials, in the order of the configuration's `measures`, float64,
                shape ``(population, n_measures)``.
            rng: as in `tell`.

        Raises:
            ValueError: as in `tell`, or measures that are not finite numbers.
        """
        return self.tell(state, fitness, rng)

    def tell_attended(
        self, state: StateT, fitness: NDArray[np.float64], operator_s: float, rng: np.random.Generator
    ) -> StateT:
        """As `tell`, with the time that a person needed for this generation.

        Only algorithms that are `attended` are told it; the default ignores it.

        Args:
            state: as in `tell`.
            fitness: as in `tell`.
            operator_s: for all attempts of its trials, void ones too; 0 if nobody was asked.
            rng: as in `tell`.

        Raises:
            ValueError: as in `tell`.
        """
        return self.tell(state, fitness, rng)

    def wanted(self, state: StateT, n_trials: int) -> NDArray[np.bool_] | None:
        """Which trials this generation is about, shape ``(population, n_trials)``; None for all of the task's."""
        return None

    def is_last(self, state: StateT) -> bool:
        """True if the run is over once this generation is evaluated, whatever the configuration allows."""
        return False

    def remark(self, state: StateT) -> str:
        """What people should know before this generation's trials: which individuals these are, and why."""
        return ""

    def heirs(self, state: StateT) -> Bits | None:
        """Genomes that another algorithm can go on from, best first, shape ``(n, L)``; None for this generation's."""
        return None

    def structures(self, state: StateT) -> list[str | None]:
        """What each individual has besides its expressed bits, as JSON for people; None where that is nothing."""
        return [None] * len(state.genomes)

    def archive(self, state: StateT) -> Archive | None:
        """The map of different controllers that `state` holds; None for algorithms that keep none."""
        return None

    @abstractmethod
    def dump(self, state: StateT) -> bytes:
        """`state` as bytes for the journal; equal states give equal bytes."""

    @abstractmethod
    def load(self, data: bytes) -> StateT:
        """The inverse of `dump`.

        Raises:
            ValueError: `data` was not written by this algorithm with these sizes.
        """

"""MAP-Elites: an archive of different good controllers, one for each cell of a grid over what they do.

Source: Mouret & Clune 2015, "Illuminating search spaces by mapping elites". The archive is pyribs'
(Tjanaka et al. 2023); selection and mutation are ours, so that all randomness comes from the run's generator. Needs the
extra ``ribs``.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sceann_hil.errors import PackageMissing
from sceann_hil.evolution.algorithm import Algorithm, Archive, State
from sceann_hil.evolution.checks import check_shape, checked_fitness, checked_measures, filled_population
from sceann_hil.evolution.dumping import Header, Reader, checked_parents, pack_bits, read_only
from sceann_hil.network.coding import Bits
from sceann_hil.plugins import AlgorithmConfig, Section

MOST_CELLS = 100_000
_VERSION = 1


class Axis(Section):
    """One dimension of the map."""

    measure: str
    """What is measured: a name that the task offers, such as a field of the body's state at the end of a trial."""
    range: tuple[float, float]
    """Lowest and highest value; what lies outside belongs to the first or the last cell."""
    cells: Annotated[int, Field(ge=1, le=MOST_CELLS)] = 10
    """Cells along this axis."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        if self.range[0] >= self.range[1]:
            raise ValueError(f"range: expected [lowest, highest], got {list(self.range)}")
        return self


@dataclass(frozen=True, slots=True)
class MapElitesState(State):
    """One batch of children, and the archive that they come from (e elites, k axes).

    Attributes:
        parent_cells: cell of each child's parent, int64, shape ``(population,)``; -1 without a parent.
        elites: genomes of the archive in the order of their cells, uint8, shape ``(e, L)``.
        cells: cell of each elite, int64, shape ``(e,)``; the last axis varies fastest.
        reached: fitness of each elite, float64, shape ``(e,)``.
        measures: what each elite was measured to do, float64, shape ``(e, k)``.
    """

    parent_cells: NDArray[np.int64]
    elites: Bits
    cells: NDArray[np.int64]
    reached: NDArray[np.float64]
    measures: NDArray[np.float64]


class MapElites(Algorithm[MapElitesState]):
    """Children of random elites; a child becomes the elite of its cell if that is empty or it is better.

    Args:
        genome_length: L, bits per genome.
        config: population, mutation and the axes of the map.
    """

    def __init__(self, genome_length: int, config: MapElitesConfig) -> None:
        self._config = config
        self._shape = (config.population, genome_length)
        self._rate = 1.0 / genome_length if config.mutation_rate is None else config.mutation_rate
        self._dims = tuple(axis.cells for axis in config.axes)
        self._header = Header("MAPE", _VERSION, len(config.axes), *self._shape)

    def start(self, rng: np.random.Generator) -> MapElitesState:
        """Independent fair bits, and an empty archive."""
        _archives()
        return self._first(rng.integers(0, 2, size=self._shape, dtype=np.uint8))

    def adopt(self, genomes: Bits, rng: np.random.Generator) -> MapElitesState:
        """The genomes as they are, and an empty archive."""
        return self._first(filled_population(genomes, *self._shape))

    def tell(self, state: MapElitesState, fitness: NDArray[np.float64], rng: np.random.Generator) -> MapElitesState:
        """Not without measures: see `tell_with_measures`."""
        raise ValueError(f"measures: expected {', '.join(self._config.measures)} of every individual, got none")

    def tell_with_measures(
        self,
        state: MapElitesState,
        fitness: NDArray[np.float64],
        measures: NDArray[np.float64],
        rng: np.random.Generator,
    ) -> MapElitesState:
        """The batch goes into the archive, and the next one comes out of it."""
        check_shape(state.genomes.shape, *self._shape)
        fitness = checked_fitness(fitness, self._shape[0])
        measures = checked_measures(measures, self._shape[0], len(self._dims))
        archive = _archives().GridArchive(
            solution_dim=self._shape[1],
            dims=self._dims,
            ranges=[axis.range for axis in self._config.axes],
            solution_dtype=np.uint8,
            objective_dtype=np.float64,
            measures_dtype=np.float64,
            extra_fields={"place": ((), np.int32)},
        )
        if len(state.elites):
            nowhere = np.full(len(state.elites), -1, np.int32)
            archive.add(state.elites, state.reached, state.measures, place=nowhere)
        archive.add(state.genomes, fitness, measures, place=np.arange(self._shape[0], dtype=np.int32))
        data: dict[str, NDArray[Any]] = archive.data()
        order = np.argsort(data["index"])
        elites, cells = data["solution"][order].astype(np.uint8), data["index"][order].astype(np.int64)
        chosen = rng.integers(len(elites), size=self._shape[0])
        flips = rng.random(self._shape) < self._rate
        return _state(
            elites[chosen] ^ flips.astype(np.uint8),
            data["place"][order][chosen].astype(np.int32),
            cells[chosen],
            elites,
            cells,
            data["objective"][order].astype(np.float64),
            data["measures"][order].astype(np.float64),
        )

    def structures(self, state: MapElitesState) -> list[str | None]:
        """Where on the map each child's parent is."""
        places = [None if cell < 0 else np.unravel_index(cell, self._dims) for cell in state.parent_cells.tolist()]
        return [None if place is None else json.dumps({"parent_cell": [int(i) for i in place]}) for place in places]

    def archive(self, state: MapElitesState) -> Archive:
        """The elites."""
        places = np.stack(np.unravel_index(state.cells, self._dims), axis=1).astype(np.int64)
        ranges = tuple(axis.range for axis in self._config.axes)
        return Archive(self._config.measures, ranges, self._dims, places, state.elites, state.reached, state.measures)

    def dump(self, state: MapElitesState) -> bytes:
        """Header, genomes (packed bits), parents (int32), their cells (int64); e (uint32), the elites' genomes, cells
        (int64), fitness and measures (float64)."""
        check_shape(state.genomes.shape, *self._shape)
        return b"".join(
            (
                self._header.pack(),
                pack_bits(state.genomes),
                state.parents.astype("<i4").tobytes(),
                state.parent_cells.astype("<i8").tobytes(),
                np.array([len(state.elites)], "<u4").tobytes(),
                pack_bits(state.elites),
                state.cells.astype("<i8").tobytes(),
                state.reached.astype("<f8").tobytes(),
                state.measures.astype("<f8").tobytes(),
            )
        )

    def load(self, data: bytes) -> MapElitesState:
        """The inverse of `dump`."""
        reader = Reader(data, self._header)
        genomes = reader.bits(self._shape)
        parents = checked_parents(reader.array("<i4", self._shape[:1]))
        parent_cells = reader.array("<i8", self._shape[:1])
        n = int(reader.array("<u4", (1,))[0])
        elites = reader.bits((n, self._shape[1]))
        cells, reached = reader.array("<i8", (n,)), reader.array("<f8", (n,))
        measures = reader.array("<f8", (n, len(self._dims)))
        reader.finish()
        most = int(np.prod(self._dims))
        for name, values, least in (("cells", cells, 0), ("parents' cells", parent_cells, -1)):
            if values.size and not (least <= values.min() and values.max() < most):
                raise ValueError(f"state: expected {name} in {least}..{most - 1}, got {values.min()}..{values.max()}")
        if not (np.isfinite(reached).all() and np.isfinite(measures).all()):
            raise ValueError("state: expected finite fitness and measures of every elite")
        return _state(genomes, parents, parent_cells, elites, cells, reached, measures)

    def _first(self, genomes: Bits) -> MapElitesState:
        nobody = np.full(self._shape[0], -1)
        return _state(
            genomes,
            nobody.astype(np.int32),
            nobody.astype(np.int64),
            np.zeros((0, self._shape[1]), np.uint8),
            np.zeros(0, np.int64),
            np.zeros(0),
            np.zeros((0, len(self._dims))),
        )


def _state(*arrays: NDArray[Any]) -> MapElitesState:
    return MapElitesState(*(read_only(np.ascontiguousarray(array)) for array in arrays))


def _archives() -> Any:
    try:
        import ribs.archives
    except ModuleNotFoundError:
        raise PackageMissing(
            "The algorithm map_elites needs the package ribs, which is not installed.", "pip install 'sceann-hil[ribs]'"
        ) from None
    return ribs.archives


class MapElitesConfig(AlgorithmConfig):
    """Settings of MAP-Elites."""

    type: Literal["map_elites"] = "map_elites"
    population: Annotated[int, Field(ge=2, le=100_000)] = 25
    """Children per batch."""
    generations: Annotated[int, Field(ge=0, le=10_000_000)] = 200
    """Batches after the initial one, so one more is evaluated."""
    mutation_rate: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    """Probability that a bit of a child flips; null = 1/L, L being the bits of a genome."""
    axes: Annotated[tuple[Axis, ...], Field(min_length=1, max_length=6)]
    """Dimensions of the map."""

    @model_validator(mode="after")
    def _map_is_bounded(self) -> Self:
        n_cells = int(np.prod([axis.cells for axis in self.axes], dtype=np.float64))
        if n_cells > MOST_CELLS:
            raise ValueError(f"axes: expected at most {MOST_CELLS} cells in all, got {n_cells}")
        if len(set(self.measures)) < len(self.axes):
            raise ValueError(f"axes: expected a different measure on each, got {', '.join(self.measures)}")
        return self

    @property
    def measures(self) -> tuple[str, ...]:
        """One for each axis."""
        return tuple(axis.measure for axis in self.axes)

    def build(self, genome_length: int) -> MapElites:
        """The algorithm for genomes of `genome_length` bits."""
        return MapElites(genome_length, self)

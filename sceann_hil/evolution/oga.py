"""The operon-GA, as our reconstruction OGA-R: never to be reported as "the OGA".

Source: what is public about Ohkura & Ueda's OGA, completed by choices of ours
(`sceann_hil.evolution.oga_options` names them). A locus stores an ordered list of bits and expresses the
first; operons partition the loci; operators copy, remove and invert the lists of whole operons, so that the
mutation rate of each locus follows the history of the search. Population 25, 50 generations, tournament 6 and
the five probabilities: Katada & Nakazawa, Section IV.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sceann_hil.evolution.algorithm import State
from sceann_hil.evolution.dumping import Header, Reader, checked_parents, pack_bits, read_only
from sceann_hil.evolution.generational import GenerationalAlgorithm, GenerationalConfig
from sceann_hil.evolution.oga_options import InitialList, InitialOperons, OGAOptions
from sceann_hil.network.coding import Bits

_VERSION = 1


@dataclass(frozen=True, slots=True)
class OGAState(State):
    """One generation of the operon-GA. `genomes` are the heads of the lists, ``values[:, :, 0]``.

    Attributes:
        values: uint8, shape ``(population, L, cap)``; the list of a locus, unused places 0.
        lengths: uint8, shape ``(population, L)``; values in each list, 1 to cap.
        operons: int16, shape ``(population, L)``; operon of each locus, numbered by first appearance.
    """

    values: Bits
    lengths: NDArray[np.uint8]
    operons: NDArray[np.int16]


class OGAConfig(OGAOptions, GenerationalConfig):
    """Settings of the operon-GA (reconstruction OGA-R)."""

    type: Literal["oga"] = "oga"
    tournament: int = Field(
        default=6,
        ge=1,
        le=100_000,
        description="Contestants per tournament, drawn with replacement; 1 = no selection.",
    )

    def build(self, genome_length: int) -> OGA:
        """The algorithm for genomes of `genome_length` bits."""
        return OGA(genome_length, self)


class OGA(GenerationalAlgorithm[OGAState]):
    """The operon-GA, reconstruction OGA-R.

    Args:
        genome_length: L, bits per genome.
        config: its settings.

    Raises:
        ValueError: genomes of such a length cannot be, or `parameter_loci` does not divide it.
    """

    def __init__(self, genome_length: int, config: OGAConfig = OGAConfig()) -> None:  # noqa: B008
        super().__init__(genome_length, config)
        self.options: OGAOptions = config
        if config.parameter_loci is not None and genome_length % config.parameter_loci:
            raise ValueError(
                f"parameter_loci: expected a divisor of the genome's {genome_length} bits, got {config.parameter_loci}"
            )
        self._rules = config.rules()
        self._header = Header("OGA", _VERSION, config.cap, config.population, genome_length)

    def start(self, rng: np.random.Generator) -> OGAState:
        """Random bits in the lists and operons of the options."""
        shape = (self.population, self.genome_length)
        cap = self.options.cap
        values = np.zeros((*shape, cap), dtype=np.uint8)
        match self.options.initial_list:
            case InitialList.ONE_VALUE:
                values[:, :, 0] = rng.integers(0, 2, size=shape, dtype=np.uint8)
            case InitialList.EQUAL_COPIES:
                values[:] = rng.integers(0, 2, size=(*shape, 1), dtype=np.uint8)
            case InitialList.RANDOM_BITS:
                values[:] = rng.integers(0, 2, size=values.shape, dtype=np.uint8)
        length = 1 if self.options.initial_list is InitialList.ONE_VALUE else cap
        return self._state(
            np.full(self.population, -1, dtype=np.int32),
            values,
            np.full(shape, length, dtype=np.uint8),
            np.stack([self._initial_operons(rng) for _ in range(self.population)]),
        )

    def adopt(self, genomes: Bits, rng: np.random.Generator) -> OGAState:
        """Each bit as the one value of its locus, and operons of the options."""
        filled = self._filled(genomes)
        values = np.zeros((*filled.shape, self.options.cap), dtype=np.uint8)
        values[:, :, 0] = filled
        return self._state(
            np.full(self.population, -1, dtype=np.int32),
            values,
            np.ones(filled.shape, dtype=np.uint8),
            np.stack([self._initial_operons(rng) for _ in range(self.population)]),
        )

    def _initial_operons(self, rng: np.random.Generator) -> NDArray[np.int16]:
        loci = np.arange(self.genome_length, dtype=np.int16)
        match self.options.initial_operons:
            case InitialOperons.ONE:
                return np.zeros_like(loci)
            case InitialOperons.SINGLETONS:
                return loci
            case InitialOperons.PER_PARAMETER:
                return loci // np.int16(self.options.parameter_loci or 1)
            case InitialOperons.RANDOM:
                labels = rng.integers(0, rng.integers(1, loci.size + 1), size=loci.size)
                return numbered_by_first_appearance(labels)

    def tell(self, state: OGAState, fitness: NDArray[np.float64], rng: np.random.Generator) -> OGAState:
        """The elites first and unchanged, then the children."""
        # Numba takes a third of a second to import, and listing or checking a config needs none of it.
        from sceann_hil.evolution.oga_generation import next_generation

        self._check_state(state)
        generation = next_generation(
            state.values,
            state.lengths,
            state.operons,
            self._checked_fitness(fitness),
            self.tournament,
            self.mutation_rate,
            self.elites,
            self._rules,
            rng,
        )
        for array in generation:
            read_only(array)
        return OGAState(*generation)

    def structures(self, state: OGAState) -> list[str | None]:
        """Operon of each locus, and the list of values of each locus as text, expressed value first."""
        n, loci, cap = state.values.shape
        digits = (state.values + ord("0")).astype(np.uint8).tobytes().decode("ascii")
        lengths, operons = state.lengths.tolist(), state.operons.tolist()
        values = [
            [digits[(first := cap * (loci * k + locus)) : first + lengths[k][locus]] for locus in range(loci)]
            for k in range(n)
        ]
        return [json.dumps({"operons": operons[k], "values": values[k]}) for k in range(n)]

    def _check_state(self, state: OGAState) -> None:
        self._check_genomes(state.genomes.shape)
        if state.values.shape[2:] != (self.options.cap,):
            raise ValueError(f"state: expected {self.options.cap} values per locus, got {state.values.shape[2:]}")

    def dump(self, state: OGAState) -> bytes:
        """Header, values (packed bits), lengths (uint8), operons (int16), parents (int32)."""
        self._check_state(state)
        return b"".join(
            (
                self._header.pack(),
                pack_bits(state.values),
                state.lengths.tobytes(),
                state.operons.astype("<i2").tobytes(),
                state.parents.astype("<i4").tobytes(),
            )
        )

    def load(self, data: bytes) -> OGAState:
        """The inverse of `dump`."""
        shape = (self.population, self.genome_length)
        cap = self.options.cap
        reader = Reader(data, self._header)
        values = reader.bits((*shape, cap))
        lengths = reader.array("u1", shape)
        operons = reader.array("<i2", shape)
        parents = checked_parents(reader.array("<i4", (self.population,)))
        reader.finish()
        if lengths.min() < 1 or lengths.max() > cap:
            raise ValueError(f"state: expected lists of 1 to {cap} values, got {lengths.min()} to {lengths.max()}")
        if np.any(values[np.arange(cap) >= lengths[:, :, None]]):
            raise ValueError("state: expected 0 behind the end of every value list, got 1")
        for individual, labels in enumerate(operons):
            if not np.array_equal(labels, numbered_by_first_appearance(labels)):
                raise ValueError(
                    f"state: expected operons numbered by first appearance, got {labels.tolist()} "
                    f"for individual {individual}"
                )
        return self._state(parents, values, lengths, operons)

    @staticmethod
    def _state(
        parents: NDArray[np.int32], values: Bits, lengths: NDArray[np.uint8], operons: NDArray[np.int16]
    ) -> OGAState:
        genomes = np.ascontiguousarray(values[:, :, 0])
        for array in (genomes, parents, values, lengths, operons):
            read_only(array)
        return OGAState(genomes, parents, values, lengths, operons)


def numbered_by_first_appearance(labels: NDArray[np.integer]) -> NDArray[np.int16]:
    """The partition that `labels` (shape ``(L,)``) describes, in its one canonical form."""
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first)).astype(np.int16)[inverse]

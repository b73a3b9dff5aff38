"""What the generational algorithms share: sizes and settings, checked once, and the check of a fitness."""

from __future__ import annotations

from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sceann_hil.evolution.algorithm import Algorithm, StateT
from sceann_hil.evolution.checks import check_shape, checked_fitness, filled_population
from sceann_hil.network.coding import Bits
from sceann_hil.plugins import AlgorithmConfig

MAX_GENOME_LENGTH = 2**15 - 1
"""Operon labels are int16."""


class GenerationalConfig(AlgorithmConfig):
    """The settings that every generational algorithm has; defaults from Katada & Nakazawa, Section IV."""

    compares_only: ClassVar[bool] = True

    population: int = Field(default=25, ge=2, le=100_000, description="Individuals per generation.")
    generations: int = Field(
        default=50,
        ge=0,
        le=10_000_000,
        description="Generations after the initial one, so one more is evaluated.",
    )
    tournament: int = Field(
        default=2,
        ge=1,
        le=100_000,
        description="Contestants per tournament, drawn with replacement; 1 = no selection.",
    )
    mutation_rate: float | None = Field(
        default=None,
        ge=0,
        le=1,
        description="Probability that a bit of a child flips; null = 1/L, L being the bits of a genome.",
    )
    elites: int = Field(
        default=1,
        ge=0,
        description="Best individuals that enter the next generation unchanged; fewer than population.",
    )

    @property
    def keeps_best(self) -> bool:
        return self.elites > 0

    @model_validator(mode="after")
    def _elites_leave_room(self) -> Self:
        if self.elites >= self.population:
            raise ValueError(
                f"elites: expected fewer than population ({self.population}), got {self.elites}; "
                f"with more nothing would ever change"
            )
        return self


class GenerationalAlgorithm(Algorithm[StateT]):
    """A fixed population in which children of tournament winners replace all but the elites.

    Args:
        genome_length: L, bits per genome, 1 to `MAX_GENOME_LENGTH`.
        config: its settings.

    Raises:
        ValueError: genomes of such a length cannot be.
    """

    def __init__(self, genome_length: int, config: GenerationalConfig) -> None:
        if not 1 <= genome_length <= MAX_GENOME_LENGTH:
            raise ValueError(f"genome_length: expected 1 to {MAX_GENOME_LENGTH}, got {genome_length}")
        self.genome_length = genome_length
        self.population = config.population
        self.tournament = config.tournament
        self.mutation_rate = 1.0 / genome_length if config.mutation_rate is None else config.mutation_rate
        self.elites = config.elites

    def _checked_fitness(self, fitness: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `checked_fitness`."""
        return checked_fitness(fitness, self.population)

    def _filled(self, genomes: Bits) -> Bits:
        """See `filled_population`."""
        return filled_population(genomes, self.population, self.genome_length)

    def _check_genomes(self, shape: tuple[int, ...]) -> None:
        """Refuse a state of another size, which compiled code would not notice."""
        check_shape(shape, self.population, self.genome_length)

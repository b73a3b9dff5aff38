"""What every algorithm checks of what it is given."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Bits


def checked_fitness(fitness: NDArray[np.float64], population: int) -> NDArray[np.float64]:
    """`fitness` as contiguous float64.

    Raises:
        ValueError: not one finite number per individual.
    """
    checked = np.ascontiguousarray(fitness, dtype=np.float64)
    if np.shape(fitness) != (population,):
        raise ValueError(f"fitness: expected shape ({population},), got {np.shape(fitness)}")
    if not np.isfinite(checked).all():
        worst = int(np.flatnonzero(~np.isfinite(checked))[0])
        raise ValueError(
            f"fitness: expected a finite number for every individual, got {checked[worst]} "
            f"for individual {worst}; attempt a failed trial again instead of grading it"
        )
    return checked


def checked_measures(measures: NDArray[np.float64], population: int, count: int) -> NDArray[np.float64]:
    """`measures` as contiguous float64.

    Raises:
        ValueError: not `count` finite numbers per individual.
    """
    checked = np.ascontiguousarray(measures, dtype=np.float64)
    if np.shape(measures) != (population, count):
        raise ValueError(f"measures: expected shape ({population}, {count}), got {np.shape(measures)}")
    if not np.isfinite(checked).all():
        raise ValueError("measures: expected finite numbers for every individual, got NaN or infinity")
    return checked


def check_shape(shape: tuple[int, ...], population: int, genome_length: int) -> None:
    """Refuse a state of another size, which compiled code would not notice.

    Raises:
        ValueError: it is of another size.
    """
    if shape != (population, genome_length):
        raise ValueError(f"state: expected genomes of shape ({population}, {genome_length}), got {shape}")


def filled_population(genomes: Bits, population: int, genome_length: int) -> Bits:
    """The genomes in turn until there are ``population`` of them, shape ``(population, L)``.

    Raises:
        ValueError: there are none, or of another length.
    """
    if genomes.ndim != 2 or len(genomes) < 1 or genomes.shape[1] != genome_length:
        raise ValueError(f"genomes: expected shape (n, {genome_length}), got {genomes.shape}")
    filled = np.asarray(genomes, np.uint8)[np.arange(population) % len(genomes)]
    return np.ascontiguousarray(filled)

"""One generation step of the simple genetic algorithm, as one compiled call."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.evolution.mutation import bits_until_flip
from sceann_hil.evolution.selection import best_individuals, tournament
from sceann_hil.network.coding import Bits
from sceann_hil.network.compiled import compiled


@compiled
def next_generation(
    genomes: Bits,
    fitness: NDArray[np.float64],
    tournament_size: int,
    mutation_rate: float,
    elites: int,
    rng: np.random.Generator,
) -> tuple[Bits, NDArray[np.int32]]:
    """The elites as they are, then mutated copies of tournament winners.

    Args:
        genomes: shape ``(population, L)``, C order.
        fitness: shape ``(population,)``, no NaN.
        tournament_size: contestants per tournament, at least 1.
        mutation_rate: probability that a bit of a child flips.
        elites: individuals kept unmutated, 0 to population.
        rng: the only source of randomness.

    Returns:
        New genomes, and the index of each one's parent in `genomes`.
    """
    population, length = genomes.shape
    parents = np.empty(population, dtype=np.int32)
    parents[:elites] = best_individuals(fitness, elites, rng)
    for child in range(elites, population):
        parents[child] = tournament(fitness, tournament_size, rng)

    children = np.empty_like(genomes)
    for child in range(population):
        children[child] = genomes[parents[child]]

    bits = children.reshape(-1)
    position = elites * length + bits_until_flip(mutation_rate, rng)
    while position < bits.size:
        bits[position] ^= 1
        position += 1 + bits_until_flip(mutation_rate, rng)
    return children, parents

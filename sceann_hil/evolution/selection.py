"""Tournament selection and elitism, compiled; larger fitness is better.

Source: Katada & Nakazawa, Section III (tournament selection, elitism 1). Contestants are drawn with
replacement, and every tie is broken at random: without that, neutral drift stops.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.compiled import compiled


@compiled
def pick(n: int, rng: np.random.Generator) -> int:
    """A uniformly random integer in ``0 .. n-1``, from one draw (bias below ``n * 2**-53``)."""
    return int(rng.random() * n)


@compiled
def tournament(fitness: NDArray[np.float64], size: int, rng: np.random.Generator) -> int:
    """The winner of one tournament.

    Args:
        fitness: shape ``(population,)``.
        size: contestants, drawn with replacement; 1 means no selection.
        rng: advanced by `size` draws.

    Returns:
        Index of the best contestant. The contestants come in random order, so the first of the best ones is
        also a random one of them.
    """
    winner = pick(fitness.size, rng)
    for _ in range(size - 1):
        contestant = pick(fitness.size, rng)
        if fitness[contestant] > fitness[winner]:
            winner = contestant
    return winner


@compiled
def best_individuals(fitness: NDArray[np.float64], count: int, rng: np.random.Generator) -> NDArray[np.int32]:
    """The `count` best individuals, best first, all different, ties at random.

    Args:
        fitness: shape ``(population,)``.
        count: 0 to population.
        rng: advanced only where there are ties.

    Returns:
        Indices, shape ``(count,)``.
    """
    best = np.empty(count, dtype=np.int32)
    taken = np.zeros(fitness.size, dtype=np.bool_)
    for rank in range(count):
        chosen, ties = -1, 0
        for individual in range(fitness.size):
            if taken[individual]:
                continue
            if chosen < 0 or fitness[individual] > fitness[chosen]:
                chosen, ties = individual, 1
            elif fitness[individual] == fitness[chosen]:
                ties += 1
                if pick(ties, rng) == 0:
                    chosen = individual
        best[rank] = chosen
        taken[chosen] = True
    return best

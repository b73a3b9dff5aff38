"""One generation step of the operon-GA (reconstruction OGA-R), as one compiled call."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.evolution.oga_options import Order, Rules, Scope
from sceann_hil.evolution.operons import connect, divide, renumber
from sceann_hil.evolution.selection import best_individuals, tournament
from sceann_hil.evolution.value_lists import choose_groups, delete, duplicate, invert, mutate_values
from sceann_hil.network.coding import Bits
from sceann_hil.network.compiled import compiled

_PER_LOCUS = Scope.PER_LOCUS.code
_STRUCTURE_FIRST = Order.STRUCTURE_FIRST.code


@compiled
def restructure(
    values: Bits,
    lengths: NDArray[np.uint8],
    operons: NDArray[np.int16],
    every_locus: NDArray[np.int16],
    rules: Rules,
    rng: np.random.Generator,
) -> None:
    """Connection, division, duplication, deletion and inversion on one child, in place."""
    n_operons = int(operons.max()) + 1
    n_operons = connect(operons, n_operons, rules.scope, rules.connection, rng)
    n_operons = divide(operons, n_operons, rules.scope, rules.divides, rules.division, rng)
    renumber(operons, n_operons)
    if rules.scope == _PER_LOCUS:
        groups, n_groups = every_locus, every_locus.size
    else:
        groups, n_groups = operons, n_operons
    chosen = choose_groups(groups, n_groups, rules.scope, rules.duplication, rng)
    duplicate(values, lengths, groups, chosen, rules.duplicates, rules.full_list)
    chosen = choose_groups(groups, n_groups, rules.scope, rules.deletion, rng)
    delete(values, lengths, groups, chosen, rules.deletes, rng)
    chosen = choose_groups(groups, n_groups, rules.scope, rules.inversion, rng)
    invert(values, lengths, groups, chosen, rules.inverts, rng)


@compiled
def next_generation(
    values: Bits,
    lengths: NDArray[np.uint8],
    operons: NDArray[np.int16],
    fitness: NDArray[np.float64],
    tournament_size: int,
    mutation_rate: float,
    elites: int,
    rules: Rules,
    rng: np.random.Generator,
) -> tuple[Bits, NDArray[np.int32], Bits, NDArray[np.uint8], NDArray[np.int16]]:
    """The elites as they are, then varied copies of tournament winners.

    Args:
        values: value lists, shape ``(population, L, cap)``.
        lengths: values in each list, shape ``(population, L)``.
        operons: operon label of each locus, shape ``(population, L)``.
        fitness: shape ``(population,)``, no NaN.
        tournament_size: contestants per tournament, at least 1.
        mutation_rate: bit mutation, per value.
        elites: individuals kept unchanged, 0 to population.
        rules: what the operators do, and how often.
        rng: the only source of randomness.

    Returns:
        Expressed genomes, parents, values, lengths and operons of the next generation.
    """
    population, length = lengths.shape
    parents = np.empty(population, dtype=np.int32)
    parents[:elites] = best_individuals(fitness, elites, rng)
    new_genomes = np.empty((population, length), dtype=np.uint8)
    new_values, new_lengths, new_operons = (
        np.empty_like(values),
        np.empty_like(lengths),
        np.empty_like(operons),
    )
    every_locus = np.arange(length).astype(np.int16)
    for child in range(population):
        if child >= elites:
            parents[child] = tournament(fitness, tournament_size, rng)
        parent = parents[child]
        new_values[child] = values[parent]
        new_lengths[child] = lengths[parent]
        new_operons[child] = operons[parent]
        if child >= elites:
            child_values, child_lengths = new_values[child], new_lengths[child]
            if rules.order == _STRUCTURE_FIRST:
                restructure(child_values, child_lengths, new_operons[child], every_locus, rules, rng)
            mutate_values(child_values, child_lengths, rules.bit_mutation, mutation_rate, rng)
            if rules.order != _STRUCTURE_FIRST:
                restructure(child_values, child_lengths, new_operons[child], every_locus, rules, rng)
        for locus in range(length):
            new_genomes[child, locus] = new_values[child, locus, 0]
    return new_genomes, parents, new_values, new_lengths, new_operons

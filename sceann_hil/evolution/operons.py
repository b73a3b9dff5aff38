"""Operons: a partition of the loci, and the two operators that change it, connection and division. Compiled.

An individual's partition is a label for each locus, int16, numbered ``0, 1, ...`` without gaps in the order
in which operons first appear. Neither operator touches a value, so neither changes what is expressed. Source:
our reconstruction OGA-R, definition of make_child.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.evolution.oga_options import Division, Scope
from sceann_hil.evolution.selection import pick
from sceann_hil.network.compiled import compiled

Operons = NDArray[np.int16]
"""Operon label of each locus, shape ``(L,)``."""

_PER_INDIVIDUAL = Scope.PER_INDIVIDUAL.code
_SIZE_BIASED = Scope.SIZE_BIASED.code
_DIVISIBLE_OPERON = Division.DIVISIBLE_OPERON.code
_RANDOM_BIPARTITION = Division.RANDOM_BIPARTITION.code


@compiled
def random_operon(operons: Operons, n_operons: int, scope: int, rng: np.random.Generator) -> int:
    """One operon, uniformly or, with the size-biased scope, that of a random locus."""
    if scope == _SIZE_BIASED:
        return int(operons[pick(operons.size, rng)])
    return pick(n_operons, rng)


@compiled
def connect(operons: Operons, n_operons: int, scope: int, probability: float, rng: np.random.Generator) -> int:
    """Merge pairs of distinct operons in place.

    Returns:
        How many operons there are now. Labels have no gaps but may be out of order: see `renumber`.
    """
    draws = 1 if scope in (_PER_INDIVIDUAL, _SIZE_BIASED) else n_operons
    for _ in range(draws):
        if rng.random() < probability and n_operons >= 2:
            one = random_operon(operons, n_operons, scope, rng)
            other = one
            while other == one:
                other = random_operon(operons, n_operons, scope, rng)
            kept, freed, last = min(one, other), max(one, other), n_operons - 1
            for locus in range(operons.size):
                if operons[locus] == freed:
                    operons[locus] = kept
                elif operons[locus] == last:
                    operons[locus] = freed
            n_operons = last
    return n_operons


@compiled
def divide(
    operons: Operons, n_operons: int, scope: int, rule: int, probability: float, rng: np.random.Generator
) -> int:
    """Cut operons in two, in place.

    Returns:
        How many operons there are now. Labels have no gaps but may be out of order: see `renumber`.
    """
    draws = 1 if scope in (_PER_INDIVIDUAL, _SIZE_BIASED) else n_operons
    for _ in range(draws):
        if rng.random() < probability and n_operons < operons.size:
            operon = random_operon(operons, n_operons, scope, rng)
            while rule == _DIVISIBLE_OPERON and np.sum(operons == operon) < 2:
                operon = random_operon(operons, n_operons, scope, rng)
            size = np.sum(operons == operon)
            if size < 2:
                continue
            if rule == _RANDOM_BIPARTITION:
                _scatter(operons, operon, n_operons, size, rng)
            else:
                _cut(operons, operon, n_operons, size, rng)
            n_operons += 1
    return n_operons


@compiled
def _cut(operons: Operons, operon: int, label: int, size: int, rng: np.random.Generator) -> None:
    """Give `label` to the loci of `operon` behind one of its ``size - 1`` inner places."""
    staying = 1 + pick(size - 1, rng)
    for locus in range(operons.size):
        if operons[locus] == operon:
            if staying == 0:
                operons[locus] = label
            else:
                staying -= 1


@compiled
def _scatter(operons: Operons, operon: int, label: int, size: int, rng: np.random.Generator) -> None:
    """Give `label` to a random subset of `operon`, neither empty nor all of it."""
    moved = 0
    while moved in (0, size):
        moved = 0
        for locus in range(operons.size):
            if operons[locus] in (operon, label):
                moves = rng.random() < 0.5
                operons[locus] = label if moves else operon
                moved += moves


@compiled
def renumber(operons: Operons, n_operons: int) -> None:
    """Number the operons by first appearance, in place: equal partitions get equal labels."""
    names = np.full(n_operons, -1, dtype=np.int16)
    used = 0
    for locus in range(operons.size):
        label = operons[locus]
        if names[label] < 0:
            names[label] = used
            used += 1
        operons[locus] = names[label]

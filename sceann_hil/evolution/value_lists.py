"""Value lists: the bits that a locus stores, and the operators on all lists of an operon at once. Compiled.

A list is ``values[locus, :lengths[locus]]``; its first value, the head, is expressed, and unused places are
0. The operators act on *groups* of loci, which are operons or, with the per-locus scope, single loci. Source:
our reconstruction OGA-R, definition of make_child.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.evolution.mutation import bits_until_flip
from sceann_hil.evolution.oga_options import BitMutation, Deletion, Duplication, FullList, Inversion, Scope
from sceann_hil.evolution.operons import random_operon
from sceann_hil.evolution.selection import pick
from sceann_hil.network.coding import Bits
from sceann_hil.network.compiled import compiled

Lengths = NDArray[np.uint8]
"""Number of values of each locus, shape ``(L,)``, 1 to cap."""
Groups = NDArray[np.int16]
"""Group of each locus, shape ``(L,)``."""
Chosen = NDArray[np.bool_]
"""Whether an operator acts on a group, shape ``(groups,)``."""

_PER_INDIVIDUAL, _SIZE_BIASED = Scope.PER_INDIVIDUAL.code, Scope.SIZE_BIASED.code
_SKIP_LOCUS, _SKIP_OPERON = FullList.SKIP_LOCUS.code, FullList.SKIP_OPERON.code
_HEAD_TO_FRONT, _DOUBLE_LIST = Duplication.HEAD_TO_FRONT.code, Duplication.DOUBLE_LIST.code
_HEAD_TO_TAIL = Duplication.HEAD_TO_TAIL.code
_RANDOM_VALUE, _TAIL = Deletion.RANDOM_VALUE.code, Deletion.TAIL.code
_WHOLE_OPERON = Deletion.WHOLE_OPERON.code
_REVERSE_LIST, _COMPLEMENT_HEAD = Inversion.REVERSE_LIST.code, Inversion.COMPLEMENT_HEAD.code
_EXPRESSED_ONLY, _SHARED = BitMutation.EXPRESSED_ONLY.code, BitMutation.SHARED.code


@compiled
def choose_groups(groups: Groups, n_groups: int, scope: int, probability: float, rng: np.random.Generator) -> Chosen:
    """Draw the groups that an operator acts on: each on its own, or at most one."""
    chosen = np.zeros(n_groups, dtype=np.bool_)
    if scope in (_PER_INDIVIDUAL, _SIZE_BIASED):
        if rng.random() < probability:
            chosen[random_operon(groups, n_groups, scope, rng)] = True
    else:
        for group in range(n_groups):
            chosen[group] = rng.random() < probability
    return chosen


@compiled
def duplicate(values: Bits, lengths: Lengths, groups: Groups, chosen: Chosen, rule: int, full_list: int) -> None:
    """Lengthen the chosen lists in place, up to ``values.shape[1]`` values; heads keep their value."""
    cap = values.shape[1]
    if full_list == _SKIP_OPERON:
        for locus in range(lengths.size):
            if _longer(lengths[locus], rule) > cap:
                chosen[groups[locus]] = False
    for locus in range(lengths.size):
        if not chosen[groups[locus]]:
            continue
        length, longer = lengths[locus], _longer(lengths[locus], rule)
        if longer > cap:
            if full_list == _SKIP_LOCUS:
                continue
            longer = cap
        if rule == _HEAD_TO_FRONT:
            for place in range(longer - 1, 0, -1):
                values[locus, place] = values[locus, place - 1]
        elif rule == _HEAD_TO_TAIL:
            values[locus, longer - 1] = values[locus, 0]
        else:
            for place in range(length, longer):
                values[locus, place] = values[locus, place - length]
        lengths[locus] = longer


@compiled
def _longer(length: int, rule: int) -> int:
    return 2 * length if rule == _DOUBLE_LIST else length + 1


@compiled
def delete(values: Bits, lengths: Lengths, groups: Groups, chosen: Chosen, rule: int, rng: np.random.Generator) -> None:
    """Remove one value of each chosen list in place, except from lists of a single value."""
    if rule == _WHOLE_OPERON:
        for locus in range(lengths.size):
            if lengths[locus] < 2:
                chosen[groups[locus]] = False
    for locus in range(lengths.size):
        if not chosen[groups[locus]] or lengths[locus] < 2:
            continue
        last = lengths[locus] - 1
        removed = 0
        if rule == _RANDOM_VALUE:
            removed = pick(last + 1, rng)
        elif rule == _TAIL:
            removed = last
        for place in range(removed, last):
            values[locus, place] = values[locus, place + 1]
        values[locus, last] = 0
        lengths[locus] = last


@compiled
def invert(values: Bits, lengths: Lengths, groups: Groups, chosen: Chosen, rule: int, rng: np.random.Generator) -> None:
    """Invert the chosen lists in place; lengths stay."""
    for locus in range(lengths.size):
        if not chosen[groups[locus]]:
            continue
        length = lengths[locus]
        if rule == _COMPLEMENT_HEAD:
            values[locus, 0] ^= 1
        elif rule == _REVERSE_LIST:
            for place in range(length // 2):
                opposite = length - 1 - place
                held = values[locus, place]
                values[locus, place] = values[locus, opposite]
                values[locus, opposite] = held
        elif length >= 2:
            other = 1 + pick(length - 1, rng)
            held = values[locus, 0]
            values[locus, 0] = values[locus, other]
            values[locus, other] = held


@compiled
def mutate_values(values: Bits, lengths: Lengths, rule: int, rate: float, rng: np.random.Generator) -> None:
    """Flip values in place, each on its own with the probability that `rule` makes of `rate`."""
    if rule == _SHARED:
        stored = 0
        for locus in range(lengths.size):
            stored += lengths[locus]
        rate *= lengths.size / stored
    untouched = bits_until_flip(rate, rng)
    for locus in range(lengths.size):
        length = 1 if rule == _EXPRESSED_ONLY else int(lengths[locus])
        place = untouched
        while place < length:
            values[locus, place] ^= 1
            place += 1 + bits_until_flip(rate, rng)
        untouched = place - length

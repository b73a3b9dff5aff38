"""The sums of a network as single additions and subtractions, with as few of them as two neurons can share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sceann_hil.network.coding import Weights

LEAST_SHARED = 6
"""Sources that two neurons must share before their sums are made together."""


@dataclass(frozen=True, slots=True)
class StraightLineSums:
    """C statements that add up one group of neurons, source by source.

    Two neurons that share many sources are added up together: `a` collects the sources with equal signs, `b` those
    with opposite ones, and the sums are a + b and a - b: one addition per source instead of two.
    """

    per_source: dict[int, list[str]]
    after: list[str]
    variables: list[str]

    @classmethod
    def of(cls, weights: Weights, group: range) -> StraightLineSums:
        """The statements for the rows of `group`."""
        sums = cls({j: [] for j in range(weights.shape[1])}, [], [])
        rows = list(group)
        while rows:
            i = rows.pop(0)
            shared = [(int(np.count_nonzero(weights[i] * weights[k])), -k) for k in rows]
            best, partner = max(shared, default=(0, 0))
            if best >= LEAST_SHARED:
                rows.remove(-partner)
                sums._pair(weights, i, -partner)
            else:
                sums._single(weights, i)
        return sums

    def _add(self, j: int, variable: str, sign: int) -> None:
        self.per_source[j].append(f"{variable} {'+' if sign > 0 else '-'}= q;")

    def _single(self, weights: Weights, i: int) -> None:
        for j in np.flatnonzero(weights[i]):
            self._add(int(j), f"s{i}", int(weights[i, j]))

    def _pair(self, weights: Weights, i: int, k: int) -> None:
        for variable, product, operators in (("a", 1, "++"), ("b", -1, "+-")):
            name = f"{variable}{i}"
            members = np.flatnonzero(weights[i] * weights[k] == product)
            if len(members) == 0:
                continue
            self.variables.append(name)
            for j in members:
                self._add(int(j), name, int(weights[i, j]))
            self.after.extend(f"s{row} {sign}= {name};" for sign, row in zip(operators, (i, k), strict=True))
        for row, other in ((i, k), (k, i)):
            for j in np.flatnonzero((weights[row] != 0) & (weights[other] == 0)):
                self._add(int(j), f"s{row}", int(weights[row, j]))

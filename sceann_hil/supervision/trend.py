"""A straight line over the logarithm of the generation: fitted while values come, and added up without a loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self


class Trend:
    """Least squares of values over x, with constant memory."""

    def __init__(self) -> None:
        self._n = 0
        self._mean_x = self._mean_y = 0.0
        self._xx = self._xy = 0.0

    def add(self, x: float, y: float) -> None:
        """One more pair (Welford's update of mean, variance and covariance)."""
        self._n += 1
        before = x - self._mean_x
        self._mean_x += before / self._n
        self._mean_y += (y - self._mean_y) / self._n
        self._xx += before * (x - self._mean_x)
        self._xy += before * (y - self._mean_y)

    @property
    def slope(self) -> float:
        """Of the line; 0 while there is none."""
        return self._xy / self._xx if self._xx > 0.0 else 0.0


@dataclass(frozen=True, slots=True)
class LogCourse:
    """``level + slope * log(1 + generation)``, never outside ``lowest .. highest``.

    Attributes:
        level: at generation 0, without limits.
        slope: per unit of the logarithm.
        lowest: limit.
        highest: limit.
    """

    level: float
    slope: float
    lowest: float
    highest: float

    @classmethod
    def constant(cls, value: float) -> Self:
        """The same in every generation."""
        return cls(value, 0.0, value, value)

    def at(self, generation: int) -> float:
        """The value in one generation."""
        return min(self.highest, max(self.lowest, self.level + self.slope * math.log1p(generation)))

    def sum(self, first: int, last: int) -> float:
        """Of the values from generation `first` to `last`, both included; 0 if there are none between."""
        if last < first:
            return 0.0
        if self.slope == 0.0 or self.at(first) == self.at(last):
            return (last - first + 1) * self.at(first)
        lower, upper = (self.lowest, self.highest) if self.slope > 0.0 else (self.highest, self.lowest)
        # below `left` the value stands at its first limit, above `right` at the other
        left = min(max(first, self._reaches(lower, math.ceil)), last + 1)
        right = min(max(left - 1, self._reaches(upper, math.floor)), last)
        between = right - left + 1
        logarithms = math.lgamma(right + 2) - math.lgamma(left + 1) if between else 0.0
        straight = between * self.level + self.slope * logarithms
        return (left - first) * lower + straight + (last - right) * upper

    def _reaches(self, limit: float, rounded: Callable[[float], int]) -> int:
        exponent = (limit - self.level) / self.slope
        return rounded(math.expm1(min(exponent, 40.0)))

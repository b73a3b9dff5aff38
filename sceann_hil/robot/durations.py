"""How long something took, many times: a histogram of constant size for latencies and lateness."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BUCKETS_PER_OCTAVE = 4
_FIRST_S = 1e-5
_BUCKETS = 24 * BUCKETS_PER_OCTAVE


class Durations:
    """A histogram of durations from 10 us to minutes with constant memory; relative resolution 19 %.

    Attributes:
        counts: durations per bucket, shape ``(96,)``; bucket k begins at 10 us times 2^(k/4).
        largest_s: the longest one.
    """

    def __init__(self) -> None:
        self.counts: NDArray[np.int64] = np.zeros(_BUCKETS, np.int64)
        self.largest_s = 0.0

    def add(self, duration_s: float) -> None:
        """One more."""
        place = int(np.log2(max(duration_s, _FIRST_S) / _FIRST_S) * BUCKETS_PER_OCTAVE)
        self.counts[min(place, _BUCKETS - 1)] += 1
        self.largest_s = max(self.largest_s, duration_s)

    def __len__(self) -> int:
        return int(self.counts.sum())

    @staticmethod
    def edges_s() -> NDArray[np.float64]:
        """Where buckets begin, and the end of the last one, shape ``(97,)``."""
        return _FIRST_S * 2.0 ** (np.arange(_BUCKETS + 1) / BUCKETS_PER_OCTAVE)

    def quantile_s(self, part: float) -> float:
        """Upper edge of the bucket below which `part` (0..1) of the durations lie; 0 if there are none."""
        if not len(self):
            return 0.0
        bucket = int(np.searchsorted(np.cumsum(self.counts), part * self.counts.sum()))
        return float(min(self.edges_s()[bucket + 1], self.largest_s))

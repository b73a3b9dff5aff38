"""What a benchmark reports, and how it takes the time."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One line of a report.

    Attributes:
        name: what was measured.
        measured: with its unit.
        promised: with its unit; empty if nothing was.
        kept: whether the promise was kept in this run; None if there was none.
    """

    name: str
    measured: str
    promised: str = ""
    kept: bool | None = None


def median_s(work: Callable[[], object], repeats: int = 5, clock: Callable[[], float] = time.perf_counter) -> float:
    """Median duration of `work` after one call to warm up.

    Args:
        work: what is measured.
        repeats: calls that count.
        clock: `time.thread_time` for work on one thread, so that other processes hardly disturb the figure.
    """
    work()
    return statistics.median(_duration_s(work, clock) for _ in range(repeats))


def _duration_s(work: Callable[[], object], clock: Callable[[], float]) -> float:
    started = clock()
    work()
    return clock() - started

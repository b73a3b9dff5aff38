"""What a Dask cluster costs beside processes of this machine: the same blocks by 2, 4 and 8 worker processes."""

from __future__ import annotations

import resource
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil
from distributed import LocalCluster
from figures import Figure

from sceann_hil.study import Block, LocalWorkers, cores, load_study
from sceann_hil.study.cluster import ClusterWorkers
from sceann_hil.study.runner import Workers

PAPER = Path(__file__).parents[2] / "configs" / "paper"
_RUNS = 10
_BLOCKS = 16
_LARGEST = 1.1
"""Processor time of the cluster, scheduler and all, over that of as many local processes."""


@dataclass(frozen=True)
class Cost:
    """Seconds by the clock, and of all processors that worked for this process and its descendants."""

    wall_s: float
    processors_s: float


def run() -> list[Figure]:
    """The same blocks, measured from when every worker has done one: starting processes is no part of the overhead.

    Judged by processor time, which does not depend on what else the machine does.
    """
    figures = []
    for n_workers in (2, 4, 8):
        local = _measured(LocalWorkers(n_workers), n_workers)
        with (
            LocalCluster(  # type: ignore[no-untyped-call]
                n_workers=n_workers, threads_per_worker=1, processes=True, dashboard_address=None
            ) as processes,
            ClusterWorkers(processes.scheduler_address) as workers,
        ):
            cluster = _measured(workers, n_workers)
        ratio = cluster.processors_s / local.processors_s
        name = f"{n_workers} worker processes on {cores()} cores against as many local ones, processor time"
        measured = f"{ratio:.2f} x (by the clock {cluster.wall_s:.1f} s and {local.wall_s:.1f} s)"
        figures.append(Figure(name, measured, f"<= {_LARGEST} x", ratio <= _LARGEST))
    return figures


def _measured(workers: Workers, n_workers: int) -> Cost:
    """From when every worker has done a block, which loads machine code, to the last result."""
    begin = end = Cost(0.0, 0.0)
    warm, last = 3 * n_workers, 4 * n_workers + _BLOCKS
    for number, _ in enumerate(workers.compute(_blocks(last)), 1):
        if number == warm:
            begin = _now()
        if number == last:
            end = _now()
    return Cost(end.wall_s - begin.wall_s, end.processors_s - begin.processors_s)


def _now() -> Cost:
    own = resource.getrusage(resource.RUSAGE_SELF)
    used = own.ru_utime + own.ru_stime
    for child in psutil.Process().children(recursive=True):
        times = child.cpu_times()
        used += times.user + times.system
    return Cost(time.perf_counter(), used)


def _blocks(count: int) -> Iterator[Block]:
    """Equal blocks of goal reach: what a study hands out."""
    condition = load_study(PAPER / "fig6.yaml").conditions[-1]
    for number in range(count):
        seeds = condition.seeds(1, range(number * _RUNS, (number + 1) * _RUNS))
        yield Block(condition.number, number * _RUNS, condition.text, tuple(seeds.tolist()))

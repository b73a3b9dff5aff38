"""What a Dask cluster costs beside processes of this machine: the same blocks by 2, 4 and 8 worker processes."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from distributed import LocalCluster
from figures import Figure

from sceann_hil.study import Block, BlockResult, LocalWorkers, cores, load_study
from sceann_hil.study.cluster import ClusterWorkers
from sceann_hil.study.runner import Workers

PAPER = Path(__file__).parents[2] / "configs" / "paper"
_RUNS = 10
_BLOCKS = 16
_LARGEST = 1.1
"""Wall-clock time of the cluster over the time of as many local processes."""


def run() -> list[Figure]:
    """The same blocks, timed from when every worker has done one: starting processes is no part of the overhead."""
    figures = []
    for n_workers in (2, 4, 8):
        local_s = _timed(LocalWorkers(n_workers), n_workers)
        with (
            LocalCluster(  # type: ignore[no-untyped-call]
                n_workers=n_workers, threads_per_worker=1, processes=True, dashboard_address=None
            ) as processes,
            ClusterWorkers(processes.scheduler_address) as workers,
        ):
            cluster_s = _timed(workers, n_workers)
        ratio = cluster_s / local_s
        name = f"{n_workers} worker processes on {cores()} cores against as many local ones"
        measured = f"{ratio:.2f} x ({cluster_s:.1f} s, {local_s:.1f} s)"
        figures.append(Figure(name, measured, f"<= {_LARGEST} x", ratio <= _LARGEST))
    return figures


def _timed(workers: Workers, n_workers: int) -> float:
    first, started = n_workers, 0.0
    for number, _ in enumerate(_results(workers, _blocks(2 * n_workers + _BLOCKS)), 1):
        if number == first:
            started = time.perf_counter()
    return time.perf_counter() - started


def _results(workers: Workers, blocks: Iterable[Block]) -> Iterator[BlockResult]:
    return workers.compute(blocks)


def _blocks(count: int) -> Iterator[Block]:
    """Equal blocks of goal reach: what a study hands out."""
    condition = load_study(PAPER / "fig6.yaml").conditions[-1]
    for number in range(count):
        seeds = condition.seeds(1, range(number * _RUNS, (number + 1) * _RUNS))
        yield Block(condition.number, number * _RUNS, condition.text, tuple(seeds.tolist()))

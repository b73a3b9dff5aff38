"""Blocks on this machine: one worker process per core, replaced when one dies."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from itertools import islice

from sceann_hil.errors import WorkersLost
from sceann_hil.study.blocks import Block, BlockResult, compute_block

MOST_DEATHS = 3
"""Times in a row that worker processes may die without a block being finished in between."""


def cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class LocalWorkers:
    """Worker processes on this machine.

    Args:
        count: how many; they use one core each.
    """

    def __init__(self, count: int) -> None:
        self.count = count

    @property
    def description(self) -> str:
        """For reports."""
        return f"{self.count} process{'es' * (self.count != 1)} on this machine"

    def compute(self, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Results in the order in which they are finished; few blocks are in the air at any time.

        Raises:
            WorkersLost: workers die again and again.
        """
        waiting = iter(blocks)
        ready: deque[Block] = deque()
        deaths = 0
        while True:
            pending: dict[Future[BlockResult], Block] = {}
            pool = self._pool()
            try:
                while True:
                    room = 2 * self.count - len(pending)
                    ready.extend(islice(waiting, max(0, room - len(ready))))
                    while ready and len(pending) < 2 * self.count:
                        pending[pool.submit(compute_block, ready[0])] = ready[0]
                        ready.popleft()
                    if not pending:
                        return
                    done, _ = wait(pending, return_when=FIRST_COMPLETED)
                    for future in done:
                        result = future.result()
                        del pending[future]
                        deaths = 0
                        yield result
            except BrokenProcessPool:
                deaths += 1
                ready.extendleft(pending.values())
                if deaths > MOST_DEATHS:
                    raise WorkersLost(
                        f"Worker processes died {deaths} times in a row; {len(ready)} blocks of runs are not done.",
                        "Is there enough memory? Results so far are kept: the same command continues.",
                    ) from None
            finally:
                pool.shutdown(wait=False, cancel_futures=True)

    def _pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(self.count, multiprocessing.get_context("spawn"), initializer=_prepare)


def _prepare() -> None:
    """The parent decides what Ctrl-C means, and nobody lives on when it was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_the_parent, name="parent", daemon=True).start()


def _end_with_the_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)

"""Blocks, or any other pieces of work, on a Dask cluster; those of a dead worker are done again elsewhere.

Needs the extra ``cluster``. The workers need this package, Python, NumPy, Numba and all plug-ins in the same versions:
results do not depend on who computes them, but another version may compute something else. Each block is refused by a
worker whose versions are others, so whoever joins later is checked too. Workers may come and go, to none and back.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from queue import Empty, SimpleQueue
from types import ModuleType
from typing import Any, Self, TypeVar

from sceann_hil.errors import PackageMissing, WorkersLost
from sceann_hil.study.blocks import Block, BlockResult, compute_block
from sceann_hil.versions import running_versions

MOST_ATTEMPTS = 5
"""Times that one block may be lost together with its worker."""
_LOOK_S = 1.0
"""So often the cluster is looked at while no block is finished."""
_W = TypeVar("_W")
_R = TypeVar("_R")
_SAME_VERSIONS = "Install the same versions on every worker, then start it again. The same command continues."


class ClusterWorkers:
    """The workers of a running Dask scheduler.

    Args:
        address: of the scheduler, such as ``tcp://10.0.0.5:8786``.
        timeout_s: how long to wait for it.
        tell: told in words when there are no workers, and when there are some again.

    Raises:
        PackageMissing: the extra is not installed.
        WorkersLost: the scheduler does not answer, or its workers have other versions.
    """

    def __init__(self, address: str, timeout_s: float = 15.0, tell: Callable[[str], object] = lambda _: None) -> None:
        self.address = address
        self._dask = _dask()
        self._tell = tell
        # what it logs when a scheduler is gone is said in one message of ours
        logging.getLogger("distributed").setLevel(logging.CRITICAL)
        try:
            self._client = self._dask.Client(address, timeout=timeout_s, set_as_default=False)
        except (OSError, ValueError) as error:
            raise WorkersLost(
                f"No Dask scheduler answers at {address}: {error}",
                "Start one with `dask scheduler` and workers with `dask worker ADDRESS`, or correct --cluster.",
            ) from None
        self._threads = 0
        self._looked = -_LOOK_S
        self._waits = False
        self._check_versions()

    @property
    def description(self) -> str:
        """For reports."""
        n = len(self._asked(self._client.nthreads))
        return f"a Dask cluster with {n} workers" if n else "a Dask cluster"

    def compute(self, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Results in the order in which they are finished; waits as long as there are no workers.

        Raises:
            WorkersLost: a block takes every worker down with it, the scheduler is gone, or a worker has other versions.
        """
        return self.map(compute_block, blocks, lambda it: f"the runs from {it.first_run} of condition {it.condition}")

    def map(self, function: Callable[[_W], _R], items: Iterable[_W], name: Callable[[_W], str]) -> Iterator[_R]:
        """What a function makes of each item, in the order in which they are finished; as `compute`.

        Args:
            function: of a module that the workers have too; the same item gives the same result anywhere.
            items: that can be pickled, as its results can.
            name: of an item, different for each, for people.

        Raises:
            WorkersLost: as in `compute`.
        """
        waiting = iter(items)
        finished: SimpleQueue[Any] = SimpleQueue()
        running: dict[str, tuple[_W, int, Any]] = {}

        def submit(item: _W, attempt: int) -> None:
            key = f"sceann-{name(item)}-{attempt}-{id(self)}"
            future = self._client.submit(_compute, function, item, _versions(), key=key, pure=False)
            running[key] = item, attempt, future
            future.add_done_callback(finished.put)

        self._look()
        try:
            while True:
                for fresh in islice(waiting, max(0, self._most_running() - len(running))):
                    submit(fresh, 1)
                if not running:
                    return
                future = self._next(finished)
                item, attempt, _ = running.pop(future.key)
                over, result = self._result(future, name(item), attempt)
                future.release()
                if over:
                    yield result
                else:
                    submit(item, attempt + 1)
        finally:
            for _, _, future in running.values():
                future.release()

    @property
    def count(self) -> int:
        """Threads of all workers, as they were a moment ago."""
        if time.monotonic() - self._looked >= _LOOK_S:
            self._look()
        return max(1, self._threads)

    def close(self) -> None:
        """Leave the cluster as it is."""
        self._client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _most_running(self) -> int:
        """Enough that nobody waits and that an adaptive cluster grows, few enough that memory stays bounded."""
        return max(4, 2 * self.count)

    def _next(self, finished: SimpleQueue[Any]) -> Any:
        """The next block that is over, one way or the other."""
        while True:
            try:
                over = finished.get(timeout=_LOOK_S)
            except Empty:
                self._look()
                continue
            if self._waits:
                # whoever was told that there are no workers is told when that is over, however quick they are
                self._look()
            return over

    def _look(self) -> None:
        """How many workers there are; says when there are none."""
        self._threads = sum(self._asked(self._client.nthreads).values())
        self._looked = time.monotonic()
        if self._threads == 0 and not self._waits:
            self._waits = True
            self._tell(
                f"The Dask cluster at {self.address} has no workers. Waiting for some: start them with "
                f"`dask worker {self.address}`."
            )
        elif self._threads > 0 and self._waits:
            self._waits = False
            self._tell(f"The Dask cluster has workers now: {self._threads} threads.")

    def _asked(self, question: Callable[[], dict[str, int]]) -> dict[str, int]:
        """What the scheduler answers."""
        if self._client.status != "running":
            raise self._scheduler_is_gone()
        try:
            return question()
        except (OSError, self._dask.client.TimeoutError):
            raise self._scheduler_is_gone() from None

    def _scheduler_is_gone(self) -> WorkersLost:
        return WorkersLost(
            f"The Dask scheduler at {self.address} is gone.",
            "Results so far are kept: start the scheduler and its workers again, then the same command continues.",
        )

    def _result(self, future: Any, name: str, attempt: int) -> tuple[bool, Any]:
        """Whether a piece of work is over, and what came out; it is not if it was lost and is to be done again."""
        try:
            return True, future.result()
        except (self._dask.KilledWorker, self._dask.client.FutureCancelledError) as error:
            if self._client.status != "running":
                raise self._scheduler_is_gone() from None
            if attempt == MOST_ATTEMPTS:
                raise WorkersLost(
                    f"The cluster lost {name} with its worker {MOST_ATTEMPTS} times: {error}",
                    "Results so far are kept: look at the workers' memory, then the same command continues.",
                ) from None
            return False, None
        except _OtherVersions as error:
            raise WorkersLost(str(error), _SAME_VERSIONS) from None
        except (ImportError, AttributeError) as error:
            # a worker that cannot even read the work is found by asking all of them
            self._check_versions()
            raise WorkersLost(f"A worker of the cluster cannot run a block: {error}.", _SAME_VERSIONS) from None

    def _check_versions(self) -> None:
        found: dict[str, Any] = self._client.run(_versions, on_error="return")
        for worker, theirs in found.items():
            if differences := _differences(_versions(), theirs):
                self._client.close()
                raise WorkersLost(_other_versions(worker, differences), _SAME_VERSIONS)


class _OtherVersions(Exception):
    """A worker whose versions are not those of whoever asks it."""


def _compute(function: Callable[[_W], _R], item: _W, versions: dict[str, str]) -> _R:
    """Do a piece of work on a worker, if its versions are the right ones."""
    if differences := _differences(versions, _versions()):
        from distributed import get_worker  # only a worker gets here

        raise _OtherVersions(_other_versions(get_worker().address, differences))
    return function(item)


def _other_versions(worker: str, differences: list[str]) -> str:
    return f"The worker {worker} computes with other versions than this process: {'; '.join(differences)}."


def _versions() -> dict[str, str]:
    """What decides the numbers: results are the same on every processor."""
    return {name: what for name, what in running_versions().items() if name not in ("machine", "processor")}


def _differences(ours: dict[str, str], theirs: object) -> list[str]:
    if not isinstance(theirs, dict):
        return [f"sceann-hil cannot be imported there ({type(theirs).__name__}: {theirs})"]
    return [
        f"{name} {theirs.get(name, 'not installed')} instead of {ours.get(name, 'none')}"
        for name in dict.fromkeys((*ours, *theirs))
        if ours.get(name) != theirs.get(name)
    ]


def _dask() -> ModuleType:
    try:
        import distributed
    except ImportError as error:
        raise PackageMissing(
            f"--cluster needs Dask, the package distributed, which is not installed ({error}).",
            "pip install 'sceann-hil[cluster]'",
        ) from None
    return distributed

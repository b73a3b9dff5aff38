"""Blocks on a Dask cluster; a dead worker's blocks are done again elsewhere.

Needs the extra ``cluster``. The workers need this package, Python, NumPy, Numba and all plug-ins in the same versions:
results do not depend on who computes them, but another version may compute something else.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from types import ModuleType
from typing import Any, Self

from sceann_hil.errors import PackageMissing, WorkersLost
from sceann_hil.study.lockstep import Block, BlockResult, compute_block
from sceann_hil.versions import running_versions

MOST_ATTEMPTS = 5
"""Times that one block may be lost together with its worker."""


class ClusterWorkers:
    """The workers of a running Dask scheduler.

    Args:
        address: of the scheduler, such as ``tcp://10.0.0.5:8786``.
        timeout_s: how long to wait for it.

    Raises:
        PackageMissing: the extra is not installed.
        WorkersLost: the scheduler does not answer, or its workers have other versions.
    """

    def __init__(self, address: str, timeout_s: float = 15.0) -> None:
        self.address = address
        self._dask = _dask()
        try:
            self._client = self._dask.Client(address, timeout=timeout_s, set_as_default=False)
        except (OSError, ValueError) as error:
            raise WorkersLost(
                f"No Dask scheduler answers at {address}: {error}",
                "Start one with `dask scheduler` and workers with `dask worker ADDRESS`, or correct --cluster.",
            ) from None
        self._check_versions()

    @property
    def description(self) -> str:
        """For reports."""
        return f"a Dask cluster with {len(self._client.nthreads())} workers"

    def compute(self, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        """Results in the order in which they are finished.

        Raises:
            WorkersLost: a block takes every worker down with it, or the scheduler is gone.
        """
        waiting = iter(blocks)
        finished = self._dask.as_completed(loop=self._client.loop)
        attempts: dict[str, tuple[Block, int]] = {}

        def submit(block: Block, attempt: int) -> None:
            key = f"sceann-{block.condition}-{block.first_run}-{attempt}-{id(self)}"
            attempts[key] = (block, attempt)
            finished.add(self._client.submit(compute_block, block, key=key, pure=False))

        for block in islice(waiting, self._in_the_air()):
            submit(block, 1)
        while attempts:
            future = next(finished)
            block, attempt = attempts.pop(future.key)
            try:
                result = future.result()
            except (self._dask.KilledWorker, self._dask.client.FutureCancelledError) as error:
                if attempt == MOST_ATTEMPTS or self._client.status != "running":
                    raise WorkersLost(
                        f"The cluster lost the runs from {block.first_run} of condition {block.condition}: {error}",
                        "Results so far are kept: look at the workers, then the same command continues.",
                    ) from None
                submit(block, attempt + 1)
                continue
            future.release()
            for fresh in islice(waiting, max(0, self._in_the_air() - len(attempts))):
                submit(fresh, 1)
            yield result

    @property
    def count(self) -> int:
        """Threads of all workers."""
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    def close(self) -> None:
        """Leave the cluster as it is."""
        self._client.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _in_the_air(self) -> int:
        """Enough that nobody waits, few enough that memory stays bounded."""
        return max(4, 2 * self.count)

    def _check_versions(self) -> None:
        found: dict[str, Any] = self._client.run(_versions, on_error="return")
        for worker, theirs in found.items():
            if differences := _differences(_versions(), theirs):
                self._client.close()
                raise WorkersLost(
                    f"The worker {worker} computes with other versions than this process: {'; '.join(differences)}.",
                    "Install the same versions on every worker, then start it again.",
                )


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

"""A real Dask scheduler and real worker processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from small_study import assert_same_results

from sceann_hil.errors import WorkersLost
from sceann_hil.study import BlockResult, LocalWorkers, Observer, Study, run_study
from sceann_hil.study import cluster as cluster_module
from sceann_hil.study.cluster import ClusterWorkers

Cluster = tuple[str, list[subprocess.Popen[bytes]]]


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    """A scheduler and two workers, each a process of its own."""
    file = tmp_path / "scheduler.json"
    with ExitStack() as stack:

        def start(module: str, *arguments: str) -> subprocess.Popen[bytes]:
            command = [sys.executable, "-m", f"distributed.cli.{module}", "--scheduler-file", str(file), *arguments]
            process = subprocess.Popen(
                command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
            )
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        workers = [
            start("dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(tmp_path))
            for _ in range(2)
        ]
        deadline = time.monotonic() + 60
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        address = json.loads(file.read_text())["address"]
        with ClusterWorkers(address, timeout_s=60) as client:
            client._client.wait_for_workers(2, timeout=60)
        yield address, workers


def test_a_worker_that_is_killed_in_the_middle_costs_no_run(cluster: Cluster, small: Study, tmp_path: Path) -> None:
    address, workers = cluster

    class Killer(Observer):
        blocks = 0

        def finished(self, condition: object, result: BlockResult) -> None:
            self.blocks += 1
            if self.blocks == 2:
                os.kill(workers[0].pid, signal.SIGKILL)

    killer = Killer()
    with ClusterWorkers(address) as on_the_cluster:
        run_study(small, tmp_path / "cluster", on_the_cluster, killer)
    assert killer.blocks > 2
    assert workers[0].wait(10) == -signal.SIGKILL
    assert workers[1].poll() is None
    run_study(small, tmp_path / "local", LocalWorkers(1))
    assert_same_results(tmp_path / "cluster", tmp_path / "local")


def test_no_scheduler_is_said_in_one_sentence() -> None:
    with pytest.raises(WorkersLost, match=r"No Dask scheduler answers at tcp://127.0.0.1:9"):
        ClusterWorkers("tcp://127.0.0.1:9", timeout_s=0.5)


@pytest.mark.parametrize("name", ["sceann-hil", "numba", "python", "somebodys-robots"])
def test_every_version_that_decides_numbers_is_compared(name: str) -> None:
    ours = cluster_module._versions()
    assert cluster_module._differences(ours, dict(ours)) == []
    (difference,) = cluster_module._differences(ours, {**ours, name: "0.0.1"})
    assert difference.startswith(f"{name} 0.0.1 instead of ")


def test_a_worker_without_this_package_is_named() -> None:
    (difference,) = cluster_module._differences({}, ModuleNotFoundError("No module named 'sceann_hil'"))
    assert "cannot be imported there" in difference

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

from sceann_hil.config import parse_config
from sceann_hil.errors import WorkersLost
from sceann_hil.run.transfer import cache
from sceann_hil.study import BlockResult, LocalWorkers, Observer, Study, run_study
from sceann_hil.study import cluster as cluster_module
from sceann_hil.study.cluster import ClusterWorkers
from sceann_hil.study.transfer.on_cluster import prepare_on

Cluster = tuple[str, list[subprocess.Popen[bytes]]]


class Processes:
    """A scheduler and its workers, each a process of its own."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self._folder = folder
        self._file = folder / "scheduler.json"
        self._stack = stack
        self.scheduler = self._start("dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        deadline = time.monotonic() + 60
        while not self._file.exists() and time.monotonic() < deadline:
            time.sleep(0.05)
        self.address: str = json.loads(self._file.read_text())["address"]

    def worker(self) -> subprocess.Popen[bytes]:
        return self._start(
            "dask_worker", "--nthreads", "1", "--no-nanny", "--no-dashboard", "--local-directory", str(self._folder)
        )

    def _start(self, module: str, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{module}", "--scheduler-file", str(self._file), *arguments]
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process


@pytest.fixture
def processes(tmp_path: Path) -> Iterator[Processes]:
    """A scheduler without workers."""
    with ExitStack() as stack:
        yield Processes(tmp_path, stack)


@pytest.fixture
def cluster(processes: Processes) -> Cluster:
    """A scheduler and two workers."""
    workers = [processes.worker() for _ in range(2)]
    with ClusterWorkers(processes.address, timeout_s=60) as client:
        client._client.wait_for_workers(2, timeout=60)
    return processes.address, workers


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


def test_a_cluster_without_workers_says_so_and_waits_for_some(
    processes: Processes, small: Study, tmp_path: Path
) -> None:
    told: list[str] = []

    def tell(words: str) -> None:
        told.append(words)
        if len(told) == 1:
            processes.worker()

    with ClusterWorkers(processes.address, timeout_s=60, tell=tell) as on_the_cluster:
        run_study(small, tmp_path / "cluster", on_the_cluster)
    assert "has no workers. Waiting for some" in told[0]
    assert processes.address in told[0]
    assert "has workers now" in told[1]
    run_study(small, tmp_path / "local", LocalWorkers(1))
    assert_same_results(tmp_path / "cluster", tmp_path / "local")


def test_a_scheduler_that_dies_is_one_message_and_the_study_goes_on_later(
    processes: Processes, small: Study, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    processes.worker()

    class Killer(Observer):
        def finished(self, condition: object, result: BlockResult) -> None:
            processes.scheduler.kill()

    with (
        ClusterWorkers(processes.address, timeout_s=60) as on_the_cluster,
        pytest.raises(WorkersLost, match=r"The Dask scheduler at tcp://\S+ is gone") as lost,
    ):
        run_study(small, tmp_path / "study", on_the_cluster, Killer())
    assert "same command continues" in lost.value.hint
    assert "Traceback" not in capfd.readouterr().err
    run_study(small, tmp_path / "study", LocalWorkers(1))
    run_study(small, tmp_path / "local", LocalWorkers(1))
    assert_same_results(tmp_path / "study", tmp_path / "local")


def test_a_worker_with_other_versions_that_joins_later_is_refused_by_name(
    processes: Processes, small: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with ClusterWorkers(processes.address, timeout_s=60, tell=lambda _: processes.worker()) as on_the_cluster:
        other = {**cluster_module._versions(), "numba": "0.0.1", "somebodys-robots": "7"}
        monkeypatch.setattr(cluster_module, "_versions", lambda: other)
        with pytest.raises(WorkersLost, match=r"The worker tcp://\S+ computes with other versions.*numba \S+ instead"):
            run_study(small, tmp_path / "study", on_the_cluster)


def test_an_adaptive_cluster_grows_from_nothing_and_shrinks(small: Study, tmp_path: Path) -> None:
    from distributed import LocalCluster

    with LocalCluster(  # type: ignore[no-untyped-call]
        n_workers=0, threads_per_worker=1, processes=True, dashboard_address=None, local_directory=str(tmp_path)
    ) as local:
        local.adapt(minimum=0, maximum=2)  # type: ignore[no-untyped-call]
        with ClusterWorkers(local.scheduler_address, timeout_s=60) as on_the_cluster:
            run_study(small, tmp_path / "cluster", on_the_cluster)
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


def test_a_transfers_ensemble_is_the_same_from_a_cluster_and_is_computed_once(
    cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = parse_config(TRANSFER, "transfer")
    fitness, told = [], []
    for place in ("here", "cluster"):
        monkeypatch.setattr(cache, "cache_folder", lambda kind, digest, p=place: tmp_path / p / f"{kind}-{digest}")
        if place == "cluster":
            with ClusterWorkers(cluster[0]) as workers:
                prepare_on(workers, config, lambda what, done, total: told.append((what, done, total)))
            monkeypatch.setattr("sceann_hil.run.transfer.ensemble.part_of_ensemble", _never)
        preparation = config.algorithm.for_experiment(config).prepared_by()
        fitness.append(preparation.prepared(preparation.candidates()).ensemble.fitness)
    assert (fitness[0] == fitness[1]).all()
    assert told[-1] == ("simulated robots", 20, 20)


def _never(*_: object) -> None:
    raise AssertionError("it was computed already")


TRANSFER = """
task: {type: goal_reach, start_m: [0.4, 0.4], headings_deg: [45, 20], max_steps: 40}
robot: {type: diffdrive, n_sensors: 3}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: transfer, evolve: 1, candidates: 20}
uncertainty: {robots: 20}
"""

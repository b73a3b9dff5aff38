"""Studies and landscapes: the paper's tables, a tenth of its Fig. 6, 2^24 genomes, and the memory that a study "
"needs."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from figures import Figure, median_s
from numpy_baseline import balance

from sceann_hil.landscape import enumerate_landscape, genomes_of
from sceann_hil.study import cores, load_study, lockstep

PAPER = Path(__file__).parents[2] / "configs" / "paper"
_START_RAD = np.deg2rad(1.0)


def run() -> list[Figure]:
    """Whole commands as a user runs them, and the same work in NumPy on one core."""
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as folder:
        out = Path(folder)
        tables_s, memory_mb = _study("tables", 50, out)
        tenth_s, more_memory_mb = _study("fig6", 5, out)
        enumerated_s = _enumerate(out)
    lockstep_ratio, enumerate_ratio = _against_numpy()
    memory_mb = max(memory_mb, more_memory_mb)
    return [
        Figure(f"Tables I and II, 20 x 50 runs, {cores()} cores", f"{tables_s:.1f} s", "< 20 s", tables_s < 20),
        Figure(f"a tenth of Fig. 6, 150 x 5 runs, {cores()} cores", f"{tenth_s:.0f} s", "< 36 s", tenth_s < 36),
        Figure(f"2^24 genomes, {cores()} cores", f"{enumerated_s:.1f} s", "< 6 s", enumerated_s < 6),
        Figure("memory of all processes of a study", f"{memory_mb:.0f} MB", "< 1000 MB", memory_mb < 1000),
        Figure("50 runs in lockstep against NumPy, one core each", f"{lockstep_ratio:.0f} times as fast"),
        Figure("enumeration against NumPy, one core each", f"{enumerate_ratio:.0f} times as fast"),
    ]


def _study(name: str, runs: int, out: Path) -> tuple[float, float]:
    """Seconds of the command, and the largest sum of resident memory over its processes, in MB."""
    command = [sys.executable, "-m", "sceann_hil.cli", "study", str(PAPER / f"{name}.yaml"), "--out", str(out)]
    started = time.perf_counter()
    process = subprocess.Popen(
        [*command, "--runs", str(runs)], stderr=subprocess.DEVNULL, start_new_session=True, cwd=PAPER.parents[1]
    )
    largest = 0.0
    while process.poll() is None:
        largest = max(largest, _resident_mb(process.pid))
        time.sleep(0.1)
    if process.returncode != 0:
        raise RuntimeError(f"{command} ended with status {process.returncode}")
    return time.perf_counter() - started, largest


def _resident_mb(session: int) -> float:
    """Resident memory of every process of a session."""
    pages = 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[3]) == session:
            pages += int(fields[21])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _enumerate(out: Path) -> float:
    config = load_study(PAPER / "landscape.yaml").conditions[4].config
    numbered = iter(range(100))
    return median_s(lambda: enumerate_landscape(config, out / f"landscape{next(numbered)}", cores()), 3)


def _against_numpy() -> tuple[float, float]:
    """How many times as fast as NumPy: the first generations of 50 runs, and a part of all genomes."""
    condition = load_study(PAPER / "tables.yaml").conditions[2]
    config, seeds = condition.config, condition.seeds(1, range(50))
    first = config.model_copy(update={"algorithm": config.algorithm.model_copy(update={"generations": 10})})
    coding, size = config.controller.coding, config.size
    with config.robot.build() as robot:
        robot.use_cores(1)
        ours = median_s(lambda: list(lockstep(first, seeds, robot)), 3, time.thread_time)
        generations = [g.genomes.reshape(-1, config.genome_length) for g in lockstep(first, seeds, robot)]
    started = time.thread_time()
    for genomes in generations:
        balance(coding.decode(genomes, size), _START_RAD, 3000)
    lockstep_ratio = (time.thread_time() - started) / ours

    n = 1 << 16
    weights = coding.decode(genomes_of(np.arange(n) * 256, config.genome_length), size)
    started = time.thread_time()
    balance(weights, _START_RAD, 3000)
    numpy_s = (time.thread_time() - started) / n
    shorter = load_study(PAPER / "landscape-codings.yaml").conditions[9].config
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as folder:
        started = time.perf_counter()
        enumerate_landscape(shorter, Path(folder), 1)
        ours_s = (time.perf_counter() - started) / (1 << shorter.genome_length)
    return lockstep_ratio, numpy_s / ours_s

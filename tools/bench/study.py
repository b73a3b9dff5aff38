"""Studies and landscapes: the paper's tables, a tenth of its Fig. 6, 2^24 genomes, and a study's memory."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from figures import Figure, median_s
from numpy_baseline import balance

from sceann_hil.study import cores, evolve_together, load_study
from sceann_hil.study.landscape import enumerate_landscape, genomes_of

PAPER = Path(__file__).parents[2] / "configs" / "paper"
_START_RAD = np.deg2rad(1.0)


def run() -> list[Figure]:
    """Whole commands as a user runs them, and the same work in NumPy on one core.

    Promises are judged by processor time per core: that is what the command takes on a machine with nothing else to do.
    """
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as folder:
        out = Path(folder)
        tables = _study("tables", 50, out)
        tenth = _study("fig6", 5, out)
        enumerated = _enumerate(out)
    together_ratio, enumerate_ratio = _against_numpy()
    memory_mb = max(tables.memory_mb, tenth.memory_mb)
    return [
        tables.figure("Tables I and II, 20 x 50 runs", 20),
        tenth.figure("a tenth of Fig. 6, 150 x 5 runs", 36),
        enumerated.figure("2^24 genomes", 6),
        Figure("memory of all processes of a study", f"{memory_mb:.0f} MB", "< 1000 MB", memory_mb < 1000),
        Figure("50 runs together against NumPy, one core each", f"{together_ratio:.0f} times as fast"),
        Figure("enumeration against NumPy, one core each", f"{enumerate_ratio:.0f} times as fast"),
    ]


@dataclass(frozen=True)
class Cost:
    """What some work took: seconds by the clock, seconds of all processors, and resident memory."""

    wall_s: float
    processors_s: float
    memory_mb: float = 0.0

    def figure(self, name: str, limit_s: float) -> Figure:
        """As a line of the report."""
        per_core_s = self.processors_s / cores()
        measured = f"{per_core_s:.1f} s of each of {cores()} cores ({self.wall_s:.1f} s by the clock)"
        return Figure(name, measured, f"< {limit_s:g} s", per_core_s < limit_s)


def _study(name: str, runs: int, out: Path) -> Cost:
    command = [sys.executable, "-m", "sceann_hil.cli", "study", str(PAPER / f"{name}.yaml"), "--out", str(out)]
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    process = subprocess.Popen(
        [*command, "--runs", str(runs)], stderr=subprocess.DEVNULL, start_new_session=True, cwd=PAPER.parents[1]
    )
    largest = 0.0
    while process.poll() is None:
        largest = max(largest, _resident_mb(process.pid))
        time.sleep(0.1)
    if process.returncode != 0:
        raise RuntimeError(f"{command} ended with status {process.returncode}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Cost(time.perf_counter() - started, used, largest)


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


def _enumerate(out: Path) -> Cost:
    command = [sys.executable, "-m", "sceann_hil.cli", "enumerate", str(PAPER / "landscape.yaml"), "--out", str(out)]
    only = "grid={controller.n_hidden: [3]}"
    before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run([*command, "--set", only], check=True, capture_output=True, cwd=PAPER.parents[1])
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Cost(time.perf_counter() - started, used)


def _against_numpy() -> tuple[float, float]:
    """How many times as fast as NumPy: the first generations of 50 runs, and a part of all genomes."""
    condition = load_study(PAPER / "tables.yaml").conditions[2]
    config, seeds = condition.config, condition.seeds(1, range(50))
    first = config.model_copy(update={"algorithm": config.algorithm.model_copy(update={"generations": 10})})
    coding, size = config.controller.coding, config.size
    with config.robot.build() as robot:
        robot.use_cores(1)
        ours = median_s(lambda: list(evolve_together(first, seeds, robot)), 3, time.thread_time)
        generations = [g.genomes.reshape(-1, config.genome_length) for g in evolve_together(first, seeds, robot)]
    started = time.thread_time()
    for genomes in generations:
        balance(coding.decode(genomes, size), _START_RAD, 3000)
    together_ratio = (time.thread_time() - started) / ours

    n = 1 << 16
    weights = coding.decode(genomes_of(np.arange(n) * 256, config.genome_length), size)
    started = time.thread_time()
    balance(weights, _START_RAD, 3000)
    numpy_s = (time.thread_time() - started) / n
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as folder:
        numbered = iter(range(10))
        ours_s = median_s(
            lambda: enumerate_landscape(config, Path(folder) / f"{next(numbered)}", 1), 1, time.process_time
        )
        ours_s /= 1 << config.genome_length
    return together_ratio, numpy_s / ours_s

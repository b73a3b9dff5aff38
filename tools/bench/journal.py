"""The journal of large populations: processor time beside the engine, bytes per trial, and questions to a big journal.

Processor time, so that other work on the machine hardly matters; the engine's own share is taken in the same run. The
big journal has 2,000,000 trials, which takes half a minute to evolve.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from figures import Figure

from sceann_hil.config import parse_config
from sceann_hil.journal import JOURNAL_NAME, JournalReader
from sceann_hil.journal.seal import Seal, seal_path
from sceann_hil.journal.tables import export_csv
from sceann_hil.robot import Results, Trials
from sceann_hil.run.experiment import Experiment

TEXT = """
task: {type: goal_reach}
robot: {type: diffdrive, n_sensors: 5}
controller: {coding: sceann1, n_hidden: 2}
algorithm: {type: sga, population: 2500, generations: 99}
"""
LONG = TEXT.replace("population: 2500, generations: 99", "population: 10, generations: 2410")
SMALL = TEXT.replace("population: 2500, generations: 99", "population: 25, generations: 100")
MANY = TEXT.replace("population: 2500", "population: 250")
"""2,000 trials a generation."""
SCEANN = str(Path(sys.executable).with_name("sceann"))


@dataclass(frozen=True)
class Evolved:
    """What a run took.

    Attributes:
        cpu_s, wall_s: all of it.
        engine_cpu_s, engine_wall_s: the robot's part.
        each_s: processor time of each generation.
    """

    cpu_s: float
    wall_s: float
    engine_cpu_s: float
    engine_wall_s: float
    each_s: list[float]


def run() -> list[Figure]:
    """Evolve once with a large population, once over many generations, and ask."""
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as name:
        folder = Path(name)
        # first: a new process is counted with what the one that started it has in memory at that moment
        memory_mb = [_evolving_mb(folder / str(generations), generations) for generations in (4, 499)]
        big = folder / "big"
        took = _evolved(big, TEXT)
        n_trials = JournalReader(big).count_attempts()
        outside_us = (took.cpu_s - took.engine_cpu_s) / n_trials * 1e6
        wall = took.wall_s / took.engine_wall_s
        size = (big / JOURNAL_NAME).stat().st_size / n_trials
        status_s, status_mb = _command([SCEANN, "status", str(big)])
        tables_s = _cpu_s(lambda: export_csv(JournalReader(big), folder / "tables"))
        opened_s = _cpu_s(lambda: Experiment.open(big).close())
        _as_if_killed(big)
        resume_s, resume_mb = _command([SCEANN, "resume", str(big), "--record", "none"])
        times_s = _evolved(folder / "long", LONG).each_s
        small = _evolved(folder / "small", SMALL)
    early, late = (sorted(times_s[first : first + 60])[30] for first in (70, 2350))
    latency_ms = (sorted(small.each_s)[50] - small.engine_cpu_s / len(small.each_s)) * 1e3
    more_mb = memory_mb[1] - memory_mb[0]
    return [
        Figure("processor time beside the engine, per trial", f"{outside_us:.1f} us", "<= 7 us", outside_us <= 7),
        Figure("wall time over the engine's own", f"{wall:.1f} x", "<= 2 x", wall <= 2),
        Figure("journal per trial (goal reach)", f"{size:.0f} B", "<= 200 B", size <= 200),
        Figure(
            "status of 2,000,000 trials", f"{status_s:.2f} s of CPU, {status_mb:.0f} MB", "<= 0.5 s", status_s <= 0.5
        ),
        Figure("tables of 2,000,000 trials", f"{tables_s:.1f} s of CPU", "<= 15 s", tables_s <= 15),
        Figure("opening 2,000,000 trials to go on", f"{opened_s:.1f} s of CPU", "<= 3 s", opened_s <= 3),
        Figure(
            "resume of 2,000,000 trials after kill -9",
            f"{resume_s:.1f} s of CPU, {resume_mb:.0f} MB",
            "<= 3 s, < 400 MB",
            resume_s <= 3 and resume_mb < 400,
        ),
        Figure(
            "a generation around 2,380 over one around 100", f"{late / early:.2f} x", "<= 1.1 x", late <= 1.1 * early
        ),
        Figure("a generation of 25 individuals beside the engine", f"{latency_ms:.1f} ms of CPU, journal included"),
        Figure(
            "memory of 1,000,000 trials beside 10,000",
            f"{memory_mb[1]:.0f} and {memory_mb[0]:.0f} MB",
            "within 20 MB",
            more_mb <= 20,
        ),
    ]


def _evolved(directory: Path, text: str) -> Evolved:
    config = parse_config(text, "bench")
    engine_s, each_s = [0.0, 0.0], []
    with Experiment.create(config, directory) as experiment, config.robot.build() as robot:
        simulate = robot.run

        def timed(trials: Trials) -> Results:
            began_s = time.process_time(), time.perf_counter()
            results = simulate(trials)
            engine_s[0] += time.process_time() - began_s[0]
            engine_s[1] += time.perf_counter() - began_s[1]
            return results

        robot.run = timed  # type: ignore[method-assign]
        began_s, before_s = (time.process_time(), time.perf_counter()), time.process_time()

        def note(_: object) -> None:
            nonlocal before_s
            each_s.append(time.process_time() - before_s)
            before_s = time.process_time()

        experiment.evolve(robot, note)
        return Evolved(time.process_time() - began_s[0], time.perf_counter() - began_s[1], *engine_s, each_s)


def _as_if_killed(directory: Path) -> None:
    """Whoever is killed leaves no digest of the file."""
    seal = Seal.read(directory / JOURNAL_NAME)
    if seal is not None:
        seal_path(directory / JOURNAL_NAME).write_text(f"{seal.transactions:<20}\n")


def _evolving_mb(directory: Path, generations: int) -> float:
    config = directory.with_suffix(".yaml")
    config.write_text(MANY.replace("generations: 99", f"generations: {generations}"))
    return _command([SCEANN, "evolve", str(config), "--out", str(directory), "--record", "none"])[1]


def _command(command: list[str]) -> tuple[float, float]:
    """Processor time and largest resident memory of a command, s and MB."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status != 0:
        raise RuntimeError(f"{command} ended with status {status}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def _cpu_s(work: Callable[[], object]) -> float:
    began_s = time.process_time()
    work()
    return time.process_time() - began_s

"""The journal of large populations: processor time beside the engine, bytes per trial, and questions to a big journal.

Processor time, so that other work on the machine hardly matters. `status`, tables and resuming are measured on the
journal of 420,000 trials and told for 2,000,000: each of them grows with the trials, or does not grow at all.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from figures import Figure

from sceann_hil.config import parse_config
from sceann_hil.journal import JOURNAL_NAME, JournalReader
from sceann_hil.journal.tables import export_csv
from sceann_hil.robot import Results, Trials
from sceann_hil.run.experiment import Experiment

TEXT = """
task: {type: goal_reach}
robot: {type: diffdrive, n_sensors: 5}
controller: {coding: sceann1, n_hidden: 2}
algorithm: {type: sga, population: 2500, generations: 20}
"""
SMALL = TEXT.replace("population: 2500, generations: 20", "population: 10, generations: 2410")
BIG = 2_000_000


def run() -> list[Figure]:
    """Evolve once with a large population, once over many generations, and ask."""
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as folder:
        big = Path(folder) / "big"
        cpu_s, engine_s, _ = _evolved(big, TEXT)
        n_trials = JournalReader(big).count_attempts()
        outside_us = (cpu_s - engine_s) / n_trials * 1e6
        size = (big / JOURNAL_NAME).stat().st_size / n_trials
        status_s = _cpu_s(lambda: _status(big))
        tables_s = _cpu_s(lambda: export_csv(JournalReader(big), Path(folder) / "tables")) * BIG / n_trials
        resume_s = _cpu_s(lambda: Experiment.open(big).close()) * BIG / n_trials
        *_, times_s = _evolved(Path(folder) / "long", SMALL)
    early, late = (sorted(times_s[first : first + 60])[30] for first in (70, 2350))
    return [
        Figure("processor time beside the engine, per trial", f"{outside_us:.1f} us", "<= 7 us", outside_us <= 7),
        Figure("journal per trial (goal reach)", f"{size:.0f} B", "<= 200 B", size <= 200),
        Figure("figures for status", f"{status_s:.2f} s", "<= 0.5 s", status_s <= 0.5),
        Figure("tables of 2,000,000 trials", f"{tables_s:.1f} s", "<= 15 s", tables_s <= 15),
        Figure("opening 2,000,000 trials to go on", f"{resume_s:.1f} s", "<= 3 s", resume_s <= 3),
        Figure(
            "a generation around 2,380 over one around 100", f"{late / early:.2f} x", "<= 1.1 x", late <= 1.1 * early
        ),
    ]


def _evolved(directory: Path, text: str) -> tuple[float, float, list[float]]:
    """Processor time of all of it, of the robot's part, and of each generation."""
    config = parse_config(text, "bench")
    engine_s, each_s = 0.0, []
    with Experiment.create(config, directory) as experiment, config.robot.build() as robot:
        simulate = robot.run

        def timed(trials: Trials) -> Results:
            nonlocal engine_s
            began_s = time.process_time()
            results = simulate(trials)
            engine_s += time.process_time() - began_s
            return results

        robot.run = timed  # type: ignore[method-assign]
        began_s = before_s = time.process_time()

        def note(_: object) -> None:
            nonlocal before_s
            each_s.append(time.process_time() - before_s)
            before_s = time.process_time()

        experiment.evolve(robot, note)
        return time.process_time() - began_s, engine_s, each_s


def _status(directory: Path) -> None:
    reader = JournalReader(directory)
    (
        reader.run(),
        reader.generations(),
        reader.champion(),
        reader.count_attempts(),
        reader.operator_s(),
        reader.sessions(),
    )


def _cpu_s(work: Callable[[], object]) -> float:
    began_s = time.process_time()
    work()
    return time.process_time() - began_s

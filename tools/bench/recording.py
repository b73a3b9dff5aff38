"""What one recorded trial costs: drawing it as chunks, writing its file, joining a generation into one file."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

from figures import Figure, median_s

from sceann_hil.config import load_config
from sceann_hil.recording import rrd
from sceann_hil.recording.chunks import trial_chunks
from sceann_hil.recording.source import RunSource
from sceann_hil.run.experiment import Experiment

CONFIG = Path(__file__).parents[2] / "configs" / "goal_reach.yaml"
GENERATION = 5


def run() -> list[Figure]:
    """A generation of the paper's goal-reach run: 25 x 8 trials, on one thread."""
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as name:
        folder = Path(name)
        _evolve(folder / "run")
        source = RunSource(folder / "run")
        trials = source.generation(GENERATION).trials
        drawn = [list(trial_chunks(source.run, trial, full=trial.champion)) for trial in trials]
        parts = [folder / f"{trial.id}.rrd" for trial in trials]
        joined = folder / "joined.rrd"

        def draw() -> None:
            for trial in trials:
                list(trial_chunks(source.run, trial, full=trial.champion))

        def write() -> None:
            for trial, chunks, part in zip(trials, drawn, parts, strict=True):
                rrd.write_recording(part, chunks, application_id="bench", recording_id=str(trial.id))

        trace_s = median_s(lambda: source.generation(GENERATION), 3)
        draw_s = median_s(draw, 3, time.process_time)
        write_s = median_s(write, 3, time.process_time)
        join_s = median_s(lambda: rrd.join(parts, joined), 3)
        check_s = median_s(lambda: rrd.check(joined, ""), 3)
        size = joined.stat().st_size
        source.close()
    n, steps = len(trials), sum(trial.steps for trial in trials)
    parts_s = {"run again with traces": trace_s, "drawn": draw_s, "written": write_s, "joined": join_s}
    all_ms = sum(parts_s.values()) / n * 1e3
    return [
        *(Figure(f"a trial is {name}", f"{seconds / n * 1e3:.2f} ms") for name, seconds in parts_s.items()),
        Figure("all of it", f"{all_ms:.2f} ms", "< 7.8 ms", all_ms < 7.8),
        Figure("size of a trial", f"{size / n / 1e3:.1f} kB of {steps / n:.0f} steps", "< 58 kB", size / n < 58e3),
        Figure("a generation's file is checked", f"{check_s * 1e3:.0f} ms"),
    ]


def _evolve(directory: Path) -> None:
    config = load_config(CONFIG, [f"algorithm.generations={GENERATION}"])
    with Experiment.create(config, directory) as experiment, config.robot.build() as robot:
        experiment.evolve(robot)

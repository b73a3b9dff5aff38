"""The shipped tasks: how often evolution solves each with each coding, and after how many generations.

A run has solved its task when its champion succeeds from every start. 100 runs of every condition; set BENCH_RUNS for
another number.
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from figures import Figure

from sceann_hil.config import load_config
from sceann_hil.study import LocalWorkers, StudyReader, cores, parse_study, run_study
from sceann_hil.study.statistics import wilson

CONFIGS = Path(__file__).parents[2] / "configs" / "tasks"
CODINGS = ["sceann1", "sceann2", "sceann3"]
SEED = 20261127


def run() -> list[Figure]:
    """A line for every task and coding."""
    runs = int(os.environ.get("BENCH_RUNS", "100"))
    with tempfile.TemporaryDirectory(prefix="sceann-bench-") as folder:
        return [figure for path in sorted(CONFIGS.glob("*.yaml")) for figure in _task(path, runs, Path(folder))]


def _task(path: Path, runs: int, folder: Path) -> list[Figure]:
    base: dict[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    for key in ("name", "seed"):
        base.pop(key)
    grid = {"controller.coding": CODINGS}
    text = yaml.safe_dump({"name": path.stem, "seed": SEED, "runs": runs, "base": base, "grid": grid}, sort_keys=False)
    study = parse_study(text, path.name)
    run_study(study, folder / path.stem, LocalWorkers(cores()))
    config = load_config(path)
    task = config.build_task()
    solved_at = getattr(config.task, "success", 0.5)
    figures = []
    reader = StudyReader(folder / path.stem)
    for condition, coding in zip(reader.conditions(), CODINGS, strict=True):
        done = reader.runs(condition.number)
        solved = int((done.successes == task.n_trials).sum())
        rate = wilson(solved, len(done))
        first = (done.best > solved_at).argmax(axis=1)[(done.best > solved_at).any(axis=1)]
        needed = f"{np.median(first):.0f}" if len(first) else "none got there"
        measured = (
            f"{100 * rate.estimate:.0f} % [{100 * rate.low:.0f}, {100 * rate.high:.0f}] of {len(done)} runs solve it; "
            f"fitness {np.median(done.fitness):.2f}; generations to {solved_at:g}: {needed}"
        )
        figures.append(Figure(f"{path.stem}, {coding}", measured))
    reader.close()
    return figures

"""The gap report, a genome's spread and the robot's drift as pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sceann_hil.journal import AttemptRow
from sceann_hil.robot.durations import Durations
from sceann_hil.run.measuring import Measurement
from sceann_hil.study.gap.comparison import GapReport
from sceann_hil.study.gap.spread import Spread

_HERE, _THERE = "tab:blue", "tab:orange"


def draw_gap(report: GapReport, simulated: Measurement, measured: Measurement, path: Path) -> None:
    """Per-genome gap with intervals, and fitness here against there."""
    figure = Figure(figsize=(10, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for number, gap in enumerate(report.genomes):
        left.plot([number, number], [gap.low, gap.high], color=_THERE)
        left.plot(number, gap.gap, "o", color=_THERE)
    left.axhline(0.0, color="0.6", linewidth=1)
    left.set(xlabel="genome, best first", ylabel="fitness on the robot - in simulation (95 %)")
    right.scatter(simulated.repeats.mean(axis=1), measured.repeats.mean(axis=1), color=_THERE)
    low, high = (f([simulated.fitness.min(), measured.fitness.min()]) for f in (min, min))
    high = max(simulated.fitness.max(), measured.fitness.max())
    right.plot([low, high], [low, high], color="0.6", linewidth=1)
    right.set(xlabel=f"fitness, {report.simulation}", ylabel=f"fitness, {report.robot}")
    right.set_title(f"rank correlation {report.rank_correlation:.2f}")
    figure.savefig(path, dpi=120)


def draw_trajectories(simulated: Measurement, measured: Measurement, path: Path, most: int = 4) -> bool:
    """Sensors and motors over time, side by side, for the first trial of some genomes; False without traces."""
    if not simulated.traces or not measured.traces:
        return False
    per_genome = simulated.fitness[0].size, measured.fitness[0].size
    n = min(most, len(simulated.fitness))
    figure = Figure(figsize=(10, 2.6 * n), layout="constrained")
    axes = np.asarray(figure.subplots(n, 2, squeeze=False))
    for row in range(n):
        pairs = ((simulated, per_genome[0], "simulation"), (measured, per_genome[1], "robot"))
        for column, (source, stride, title) in enumerate(pairs):
            axis: Axes = axes[row, column]
            trace = source.traces[row * stride]
            axis.plot(trace.sensors / 1023.0, linewidth=1)
            axis.plot(trace.x[:, -1] / 1024.0, color="0.3", linewidth=0.7, linestyle="--")
            axis.set(ylim=(-0.02, 1.02), title=f"genome {row}, {title}: {len(trace.sensors)} steps")
    axes[-1, 0].set_xlabel("step (sensors solid, last motor dashed)")
    figure.savefig(path, dpi=110)
    return True


def draw_timing(timing: dict[str, Durations], path: Path) -> None:
    """One histogram for each duration: round trips of the link, lateness of the control tick, ..."""
    figure = Figure(figsize=(5 * max(1, len(timing)), 3.6), layout="constrained")
    axes = np.asarray(figure.subplots(1, max(1, len(timing)), squeeze=False))
    for axis, (name, durations) in zip(axes[0], timing.items(), strict=False):
        edges_ms = 1e3 * durations.edges_s()
        axis.stairs(durations.counts, edges_ms, fill=True)
        axis.set(xscale="log", yscale="symlog", xlabel="ms", ylabel="count", title=f"{name} ({len(durations)})")
    figure.savefig(path, dpi=120)


def draw_spread(fitness: Sequence[float], spread: Spread, path: Path) -> None:
    """Every repeat, and the mean with its interval."""
    figure = Figure(figsize=(6, 3.6), layout="constrained")
    axis = figure.subplots()
    axis.plot(fitness, "o", color=_HERE)
    axis.axhspan(spread.low, spread.high, color=_HERE, alpha=0.15)
    axis.axhline(spread.mean, color=_HERE)
    axis.set(xlabel="repeat", ylabel="fitness", title=f"{spread.mean:.4g} ± {spread.deviation:.3g} (one repeat)")
    figure.savefig(path, dpi=120)


def draw_drift(rows: Sequence[AttemptRow], path: Path) -> None:
    """The reference genome's fitness over the run."""
    figure = Figure(figsize=(6, 3.6), layout="constrained")
    axis = figure.subplots()
    counted = [(row.id, row.fitness) for row in rows if row.fitness is not None]
    axis.plot([attempt for attempt, _ in counted], [fitness for _, fitness in counted], "o-", color=_HERE)
    axis.set(xlabel="trial of the run", ylabel="fitness of the reference genome")
    figure.savefig(path, dpi=120)

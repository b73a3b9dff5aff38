"""The gap report, a genome's spread and the robot's drift as pictures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sceann_hil.journal import AttemptRow
from sceann_hil.robot import Trace
from sceann_hil.robot.drawing import Drawing
from sceann_hil.robot.durations import Durations
from sceann_hil.run.measuring import Measurement
from sceann_hil.study.gap.comparison import GapReport
from sceann_hil.study.gap.spread import Spread
from sceann_hil.study.scene import draw_robot, draw_surroundings
from sceann_hil.study.style import BLUE, DARK, GREY, MARKERS, ORANGE, SERIES, drawing, plain
from sceann_hil.versions import maker

_HERE, _THERE = BLUE, ORANGE
_DPI = 140


def draw_gap(report: GapReport, simulated: Measurement, measured: Measurement, path: Path) -> None:
    """Per-genome gap with intervals, and fitness here against there."""
    with drawing(19.0, 8.5) as figure:
        left, right = figure.subplots(1, 2)
        for number, gap in enumerate(report.genomes):
            if gap.low is not None and gap.high is not None:
                left.plot([number, number], [gap.low, gap.high], color=_THERE, label=_once(number, "95 % interval"))
            left.plot(number, gap.gap, "o", color=_THERE, label=_once(number, "mean of its repeats"))
        left.axhline(0.0, color=GREY, linewidth=1, label="no gap")
        left.set_xticks(range(len(report.genomes)), [gap.genome for gap in report.genomes], rotation=45, ha="right")
        left.set(title="Gap of each genome", xlabel="genome, best first", ylabel="fitness on the robot - in simulation")
        means = [measurement.repeats.mean(axis=1) for measurement in (simulated, measured)]
        right.scatter(*means, color=_THERE, label="one genome, mean of its repeats", zorder=3)
        low, high = min(map(np.min, means)), max(map(np.max, means))
        right.plot([low, high], [low, high], color=GREY, linewidth=1, label="the same here and there")
        right.set(
            xlabel=f"fitness in simulation ({report.simulation})", ylabel=f"fitness on the robot ({report.robot})"
        )
        rank = "" if report.rank_correlation is None else f": rank correlation {report.rank_correlation:.2f}"
        right.set_title(f"Here and there{rank}")
        for axes in (left, right):
            axes.legend()
        _save(figure, path)


@dataclass(frozen=True, slots=True)
class Shown:
    """What the robot of a comparison looks like, and what its signals are called.

    Attributes:
        drawing: of the simulated robot; None if there is nothing to draw but signals.
        state_fields: names of the body's state in traces.
        sensors: a name for each sensor.
        motors: a name for each motor neuron.
    """

    drawing: Drawing | None
    state_fields: tuple[str, ...]
    sensors: Sequence[str]
    motors: Sequence[str]


def draw_trajectories(
    simulated: Measurement, measured: Measurement, genomes: Sequence[str], shown: Shown, path: Path, most: int = 4
) -> bool:
    """Where the bodies went, and sensors and motors over time, for the first trial of some genomes; False without
    traces.

    Args:
        simulated: what the simulation did.
        measured: what the robot did.
        genomes: a name for each genome.
        shown: what can be drawn.
        path: of the picture.
        most: so many genomes.
    """
    if not simulated.traces or not measured.traces:
        return False
    n, first = min(most, len(simulated.fitness)), int(shown.drawing is not None)
    with drawing(19.0 + 8.0 * first, 2.0 + (6.0 if first else 4.6) * n) as figure:
        grid = figure.subplots(n, 2 + first, squeeze=False)
        for row, axes_of_row in enumerate(grid):
            traces = [source.traces[row * source.fitness[0].size] for source in (simulated, measured)]
            if shown.drawing is not None:
                _draw_bodies(axes_of_row[0], shown.drawing, shown.state_fields, *traces)
                axes_of_row[0].set_title(f"{genomes[row]}: where it went")
            for axes, trace, where in zip(axes_of_row[first:], traces, ("simulation", "robot"), strict=True):
                _draw_signals(axes, trace, shown.sensors, shown.motors)
                axes.set_title(f"{genomes[row]}, {where}: {len(trace.sensors)} steps")
            axes_of_row[first].set_ylabel("part of full scale")
        for axes in grid[-1][first:]:
            axes.set_xlabel("step of the first trial")
        lines, labels = grid[0, first].get_legend_handles_labels()
        figure.legend(lines, labels, loc="outside lower center", ncols=min(6, len(labels)))
        _save(figure, path)
    return True


def _draw_bodies(axes: Axes, scene: Drawing, fields: tuple[str, ...], here: Trace, there: Trace) -> None:
    """The surroundings, both paths, and the bodies at the trial's start and end; a robot's where it is known."""
    plain(axes)
    draw_surroundings(axes, scene)
    place = {name: column for column, name in enumerate(fields)}
    for trace, colour, style, name in ((here, _HERE, "-", "simulation"), (there, _THERE, "--", "robot")):
        if trace.state.shape[1] != len(fields):
            axes.text(
                0.5, -0.03, "the robot does not know where it was", ha="center", va="top", transform=axes.transAxes
            )
            continue
        robot = scene.parts[0]
        if robot.x is not None and robot.y is not None:
            x, y = trace.state[:, place[robot.x]], trace.state[:, place[robot.y]]
            axes.plot(x, y, color=colour, linestyle=style, linewidth=1.4, label=name)
        for step, alpha in ((0, 0.35), (-1, 0.9)):
            draw_robot(axes, scene, dict(zip(fields, trace.state[step].tolist(), strict=True)), alpha)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper left")


def _draw_signals(axes: Axes, trace: Trace, sensors: Sequence[str], motors: Sequence[str]) -> None:
    for j, name in enumerate(sensors):
        colour = SERIES[j % len(SERIES)]
        style = ("-", ":", "-.")[j // len(SERIES) % 3]
        axes.plot(trace.sensors[:, j] / 1023.0, color=colour, linestyle=style, linewidth=1, label=f"sensor {name}")
    for m, name in enumerate(motors):
        values = trace.x[:, len(trace.x[0]) - len(motors) + m] / 1024.0
        axes.plot(values, color=(DARK, GREY)[m % 2], linestyle="--", linewidth=0.8, label=f"motor {name}")
    axes.set_ylim(-0.02, 1.02)


def draw_timing(timing: dict[str, Durations], path: Path) -> None:
    """One histogram for each duration: round trips of the link, lateness of the control tick, ..."""
    with drawing(10.0 * max(1, len(timing)), 8.0) as figure:
        grid = figure.subplots(1, max(1, len(timing)), squeeze=False)
        for axis, (name, durations) in zip(grid[0], timing.items(), strict=False):
            axis.stairs(durations.counts, 1e3 * durations.edges_s(), fill=True, color=_HERE)
            axis.set(xscale="log", yscale="symlog", xlabel="ms", ylabel="how often", title=f"{name} ({len(durations)})")
        _save(figure, path)


def draw_spread(fitness: Sequence[float], spread: Spread, path: Path) -> None:
    """Every repeat, and the mean with its interval."""
    with drawing(14.0, 8.5) as figure:
        axis = figure.subplots()
        axis.plot(range(1, len(fitness) + 1), fitness, MARKERS[0], color=_HERE, label="one repeat of all trials")
        axis.axhspan(spread.low, spread.high, color=_HERE, alpha=0.15, label="95 % interval of the mean")
        axis.axhline(spread.mean, color=_HERE, label="mean")
        axis.set(xlabel="repeat", ylabel="fitness", title=f"{spread.mean:.4g} ± {spread.deviation:.3g} (one repeat)")
        figure.legend(loc="outside lower center", ncols=3)
        _save(figure, path)


def draw_drift(rows: Sequence[AttemptRow], path: Path) -> None:
    """The reference genome's fitness over the run."""
    with drawing(14.0, 8.5) as figure:
        axis = figure.subplots()
        counted = [(row.id, row.fitness) for row in rows if row.fitness is not None]
        axis.plot([attempt for attempt, _ in counted], [fitness for _, fitness in counted], "o-", color=_HERE)
        axis.set(xlabel="trial of the run", ylabel="fitness", title="The reference genome over the run")
        _save(figure, path)


def _once(number: int, label: str) -> str | None:
    """A label for the first of many lines."""
    return label if number == 0 else None


def _save(figure: Figure, path: Path) -> None:
    figure.savefig(path, dpi=_DPI, metadata={"Software": maker()})

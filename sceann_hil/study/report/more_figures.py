"""Figures that go beyond the paper: exact landscapes, sensitivity, robustness."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from sceann_hil.network.controller import Neuron
from sceann_hil.study.landscape import Landscape
from sceann_hil.study.robustness import Robustness
from sceann_hil.study.statistics import Interval
from sceann_hil.study.style import BLUE, DARK, GREY, MARKERS, ORANGE, SERIES, drawing, plain, save

_AT_ONCE = 1 << 20


def draw_landscapes(landscapes: Sequence[Landscape], path: Path) -> None:
    """Fraction of all genomes that reach a fitness, for both readings of the neuron; one panel per network."""
    sizes = sorted({landscape.config.size.n_hidden for landscape in landscapes})
    colours = {Neuron.ACCUMULATING: BLUE, Neuron.MEMORYLESS: ORANGE}
    with drawing(17.0, 7.4) as figure:
        row = np.atleast_1d(figure.subplots(1, len(sizes), sharey=True))
        for axes, n_hidden in zip(row, sizes, strict=True):
            for landscape in landscapes:
                config = landscape.config
                if config.size.n_hidden == n_hidden:
                    steps, fraction = reached_fraction(landscape)
                    neuron = config.controller.neuron
                    axes.plot(steps, fraction, color=colours[neuron], label=neuron.value, drawstyle="steps-post")
                    axes.set_title(f"({config.size.n_sensors},{n_hidden}): $2^{{{config.genome_length}}}$ genomes")
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xlim(10.0, 3600.0)
            axes.set_xlabel("steps balanced")
            axes.axvline(3000, color=DARK, linewidth=0.9, linestyle=":")
        row[0].set_ylabel("part of all genomes\nthat balance so long")
        lines, labels = row[-1].get_legend_handles_labels()
        figure.legend(lines, labels, loc="outside lower center", ncols=2, title="reading of Eq. (1)")
        save(figure, path)


def reached_fraction(landscape: Landscape) -> tuple[list[float], list[float]]:
    """Every fitness of at least 1 that occurs, and the part of all genomes that reach it."""
    fitness = landscape.fitness
    count: dict[float, int] = {}
    for first in range(0, len(fitness), _AT_ONCE):
        for value, n in zip(*np.unique(fitness[first : first + _AT_ONCE], return_counts=True), strict=True):
            count[float(value)] = count.get(float(value), 0) + int(n)
    values = sorted(count)
    reached = np.cumsum([count[value] for value in values[::-1]])[::-1] / len(fitness)
    return [max(value, 1.0) for value in values], reached.tolist()


@dataclass(frozen=True, slots=True)
class ForestRow:
    """One line of a forest plot.

    Attributes:
        name: for people.
        interval: in displayed units.
        reference: the interval that it is compared with; its own for a default.
        differs: it stands out.
    """

    name: str
    interval: Interval
    reference: Interval
    differs: bool


def draw_forest(rows: Sequence[ForestRow], xlabel: str, path: Path) -> None:
    """One line per variant with its interval, against the band of its reference; what differs is orange."""
    lines = max(row.name.count("\n") for row in rows) + 1
    with drawing(17.0, 2.0 + (0.24 + 0.32 * lines) * len(rows)) as figure:
        axes = figure.subplots()
        for number, row in enumerate(rows):
            own = row.interval == row.reference
            colour = DARK if own else ORANGE if row.differs else BLUE
            span = row.reference.high - row.reference.low
            band = Rectangle((row.reference.low, number - 0.5), span, 1.0, facecolor="#d1e5f0", linewidth=0, zorder=0)
            axes.add_patch(band)
            axes.plot([row.interval.low, row.interval.high], [number, number], color=colour, linewidth=1.3)
            axes.plot([row.interval.estimate], [number], marker="o", color=colour)
        axes.set_yticks(range(len(rows)), [row.name for row in rows])
        axes.set_ylim(len(rows) - 0.4, -0.6)
        axes.grid(axis="y", visible=False)
        axes.tick_params(axis="y", length=0)
        axes.set_xlabel(xlabel)
        save(figure, path)


def draw_robustness(groups: Mapping[str, tuple[Robustness, int]], path: Path) -> None:
    """Success against disturbance: mean of each group's champions, and the best of all of them dashed.

    Args:
        groups: what was measured, and how many champions, by the group's name.
        path: without suffix.
    """
    first = next(iter(groups.values()))[0]
    with drawing(17.0, 10.5) as figure:
        grid = figure.subplots(2, 3, sharey=True)
        panels = grid.ravel()
        for index, disturbance in enumerate(first.disturbances):
            axes: Axes = panels[index]
            at = np.arange(len(disturbance.levels))
            for number, (name, (found, n)) in enumerate(groups.items()):
                success = 100.0 * found.success[index]
                best = int(found.score.argmax())
                style: Any = {"color": SERIES[number], "marker": MARKERS[number], "markersize": 3.5}
                axes.plot(at, success.mean(axis=1), label=f"{name}: {n} champions", **style)
                axes.plot(at, success[:, best], linestyle="--", **style)
            axes.set_xticks(at, [f"{disturbance.scale * level:g}" for level in disturbance.levels])
            axes.set_title(disturbance.name)
            axes.set_xlabel(disturbance.unit)
            axes.set_ylim(-3.0, 103.0)
            axes.grid(axis="x", visible=False)
        for axes in grid[:, 0]:
            axes.set_ylabel("trials that succeed (%)")
        lines, _ = panels[0].get_legend_handles_labels()
        lines.append(Line2D([], [], color=GREY, label="solid: their mean"))
        lines.append(Line2D([], [], color=GREY, linestyle="--", label="dashed: the most robust one"))
        for axes in panels[len(first.disturbances) :]:
            plain(axes)
        panels[-1].legend(handles=lines, loc="center left")
        save(figure, path)

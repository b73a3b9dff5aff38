"""Figures of any study: one for each axis of its grid, and learning curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sceann_hil.study.condition import setting_text
from sceann_hil.study.report.cells import Cell
from sceann_hil.study.statistics import Interval, contrast, mean_interval, wilson
from sceann_hil.study.style import MARKERS, SERIES, drawing, save

_MOST_LINES = 5
_MOST_CURVES = 8
_SPREAD = 0.05


def draw_axis(cells: Sequence[Cell], axis: str, path: Path) -> None:
    """Fitness and success rate over the values of one axis.

    Args:
        cells: the study's conditions, with at least two runs each.
        axis: its dotted key.
        path: without suffix.
    """
    names = list(dict.fromkeys(_value(cell, axis) for cell in cells))
    lines = _lines(cells, axis)
    with drawing(17.0, 8.5) as figure:
        left, right = figure.subplots(1, 2)
        for number, (label, members) in enumerate(lines.items()):
            places = [names.index(name) + _SPREAD * (number - (len(lines) - 1) / 2.0) for name in members]
            _points(left, places, [_mean_fitness(group) for group in members.values()], number, label)
            _points(right, places, [_success_percent(group) for group in members.values()], number, label)
        for axes, title in ((left, "best fitness, last generation"), (right, "runs that succeed (%)")):
            axes.set_xticks(range(len(names)), names, rotation=0 if max(map(len, names)) < 9 else 20)
            axes.set_xlabel(axis)
            axes.set_title(title)
            axes.grid(axis="x", visible=False)
        right.set_ylim(-3.0, 103.0)
        _legend(figure, left, len(lines))
        save(figure, path)


def draw_learning(cells: Sequence[Cell], path: Path) -> None:
    """Best fitness of each generation; a line for each condition, or for each value of the first axis.

    Args:
        cells: the study's conditions, with at least two runs each.
        path: without suffix.
    """
    lines: dict[str, list[Cell]] = {}
    for cell in cells:
        label = cell.condition.label
        if len(cells) > _MOST_CURVES and cell.condition.settings:
            label = setting_text(*cell.condition.settings[0])
        lines.setdefault(label, []).append(cell)
    with drawing(17.0, 9.0) as figure:
        axes = figure.subplots()
        for number, (label, members) in enumerate(lines.items()):
            colour = SERIES[number % len(SERIES)]
            style = ("-", "--", ":", "-.")[number // len(SERIES) % 4]
            length = min(cell.runs.best.shape[1] for cell in members)
            best = np.concatenate([cell.runs.best[:, :length] for cell in members]).astype(np.float64)
            mean, generation = best.mean(axis=0), np.arange(length)
            reach = 1.96 * best.std(axis=0, ddof=1) / np.sqrt(len(best))
            axes.fill_between(generation, mean - reach, mean + reach, color=colour, alpha=0.15, linewidth=0)
            axes.plot(generation, mean, color=colour, linestyle=style, label=label)
        axes.set_xlabel("generation")
        axes.set_ylabel("best fitness")
        _legend(figure, axes, len(lines))
        save(figure, path)


def _lines(cells: Sequence[Cell], axis: str) -> dict[str, dict[str, list[Cell]]]:
    """Conditions by line, then by the value on the axis."""
    others = [[(key, value) for key, value in cell.condition.settings if key != axis] for cell in cells]
    labels = [", ".join(setting_text(key, value) for key, value in rest) for rest in others]
    if len(set(labels)) > _MOST_LINES:
        labels = ["mean over the other axes"] * len(cells)
    lines: dict[str, dict[str, list[Cell]]] = {}
    for cell, label in zip(cells, labels, strict=True):
        lines.setdefault(label, {}).setdefault(_value(cell, axis), []).append(cell)
    return lines


def _value(cell: Cell, axis: str) -> str:
    """Where a condition is on an axis, without the axis's name."""
    value = dict(cell.condition.settings)[axis]
    return setting_text(axis, value) if isinstance(value, dict) else str(value)


def _mean_fitness(cells: Sequence[Cell]) -> Interval:
    if len(cells) == 1:
        return mean_interval(cells[0].fitness)
    samples: Mapping[int, np.ndarray[tuple[int], np.dtype[np.float64]]] = {
        k: np.asarray(cell.fitness, np.float64) for k, cell in enumerate(cells)
    }
    return contrast(samples, dict.fromkeys(samples, 1.0 / len(cells)))


def _success_percent(cells: Sequence[Cell]) -> Interval:
    found = wilson(sum(cell.rate[0] for cell in cells), sum(cell.n for cell in cells))
    return Interval(100.0 * found.estimate, 100.0 * found.low, 100.0 * found.high)


def _points(axes: Axes, places: Sequence[float], intervals: Sequence[Interval], number: int, label: str) -> None:
    means = [interval.estimate for interval in intervals]
    reach = [[i.estimate - i.low for i in intervals], [i.high - i.estimate for i in intervals]]
    colour, marker = SERIES[number % len(SERIES)], MARKERS[number % len(MARKERS)]
    axes.errorbar(places, means, yerr=reach, color=colour, marker=marker, label=label or None, capsize=1.8)


def _legend(figure: Figure, axes: Axes, n_lines: int) -> None:
    lines, labels = axes.get_legend_handles_labels()
    if n_lines > 1 or any(labels):
        figure.legend(lines, labels, loc="outside lower center", ncols=min(3, max(1, len(labels))))

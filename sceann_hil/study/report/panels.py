"""Fig. 6 and Fig. 10: six panels, one per coding and algorithm; means of the best fitness with 95 % intervals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.axes import Axes

from sceann_hil.network.coding import Coding
from sceann_hil.study.report.cells import Cell, Key
from sceann_hil.study.report.claims import ALGORITHMS, HIDDEN
from sceann_hil.study.statistics import mean_interval
from sceann_hil.study.style import BLUE, MARKERS, ORANGE, SERIES, drawing, save

_SMALL = 0.12


def draw_fig6(cells: Mapping[Key, Cell], sensors: Sequence[int], path: Path) -> None:
    """Fitness over the number of sensors, one line for each number of hidden neurons."""
    with drawing(17.0, 18.5) as figure:
        grid = figure.subplots(len(Coding), len(ALGORITHMS), sharex=True, sharey=True)
        for (coding, algorithm), axes in _panels(grid):
            for index, n_hidden in enumerate(HIDDEN):
                keys = [Key(coding, algorithm, n_sensors, n_hidden) for n_sensors in sensors]
                shift = _SMALL * (index - 2)
                _line(axes, cells, keys, [n + shift for n in sensors], SERIES[index], MARKERS[index], f"{n_hidden}")
            axes.set_xticks(list(sensors))
        for axes in grid[-1]:
            axes.set_xlabel("sensors $N_s$")
        for axes in grid[:, 0]:
            axes.set_ylabel("maximum fitness,\nlast generation")
        lines, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(lines, labels, loc="outside lower center", ncols=5, title="hidden neurons $N_h$")
        save(figure, path)


def draw_fig10(cells: Mapping[Key, Cell], sensors: Sequence[int], path: Path) -> None:
    """Steps balanced over the number of hidden neurons, one line for each number of sensors."""
    with drawing(17.0, 17.5) as figure:
        grid = figure.subplots(len(Coding), len(ALGORITHMS), sharex=True, sharey="row")
        for (coding, algorithm), axes in _panels(grid):
            for index, n_sensors in enumerate(sensors):
                keys = [Key(coding, algorithm, n_sensors, n_hidden) for n_hidden in HIDDEN]
                colour = (BLUE, ORANGE)[index]
                _line(axes, cells, keys, list(HIDDEN), colour, MARKERS[index], f"$N_s$ = {n_sensors}")
            axes.set_xticks(HIDDEN)
        for axes in grid[-1]:
            axes.set_xlabel("hidden neurons $N_h$")
        for axes in grid[:, 0]:
            axes.set_ylim(bottom=0.0)
            axes.set_ylabel("maximum fitness (steps),\nlast generation")
        lines, labels = grid[0, 0].get_legend_handles_labels()
        figure.legend(lines, labels, loc="outside lower center", ncols=2)
        save(figure, path)


def _panels(grid: object) -> list[tuple[tuple[Coding, str], Axes]]:
    panels = []
    letter = iter("abcdef")
    for row, coding in enumerate(Coding):
        for column, algorithm in enumerate(ALGORITHMS):
            axes: Axes = grid[row, column]  # type: ignore[index]
            axes.set_title(f"({next(letter)}) {coding.name} by the {algorithm.upper()}")
            axes.grid(axis="x", visible=False)
            panels.append(((coding, algorithm), axes))
    return panels


def _line(
    axes: Axes,
    cells: Mapping[Key, Cell],
    keys: Sequence[Key],
    at: Sequence[float],
    colour: str,
    marker: str,
    label: str,
) -> None:
    intervals = [mean_interval(cells[key].fitness) for key in keys]
    means = [interval.estimate for interval in intervals]
    reach = [[i.estimate - i.low for i in intervals], [i.high - i.estimate for i in intervals]]
    axes.errorbar(
        at, means, yerr=reach, color=colour, marker=marker, label=label, capsize=1.8, elinewidth=0.9, capthick=0.9
    )

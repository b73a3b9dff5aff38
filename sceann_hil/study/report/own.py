"""The report of any study: its own title and words, figures of every axis, learning curves, pairwise tests."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
import yaml
from numpy.typing import NDArray

from sceann_hil.study.condition import setting_text
from sceann_hil.study.pairwise import MOST_RUNS, Pair, all_pairs
from sceann_hil.study.report.axis_figures import draw_axis, draw_learning
from sceann_hil.study.report.cells import Cell, StudyData
from sceann_hil.study.report.page import Page, file_name
from sceann_hil.study.report.wording import percent, runs_sentence
from sceann_hil.study.statistics import FEWEST_RUNS, mean_interval, wilson

_Values = Callable[[Cell], NDArray[np.float64]]
"""What of a condition's runs is compared."""

MOST_IN_PAIRS = 8
"""More conditions than these are compared axis by axis."""


def study_section(page: Page, study: StudyData, level: int = 2) -> None:
    """Everything that one study says.

    Args:
        page: gets it.
        study: with at least one condition that has runs.
        level: of its headings.
    """
    page.text(*([study.about] if study.about else []), runs_sentence(study))
    name = file_name(study.name)
    page.heading("Results", level)
    page.data_table(f"{name}-conditions", *_conditions_table(study.cells))
    if any(cell.n < 2 for cell in study.cells):
        page.text("Intervals, figures and tests need at least two runs of every condition.")
        return
    for axis in axes_of(study.cells):
        caption = (
            f"{axis}: fitness of the champions and success rate, mean over the runs with 95 % intervals; one line for "
            "each combination of the other axes, or their mean where there are many."
        )
        page.figure(f"{name}-{file_name(axis)}", caption, partial(draw_axis, study.cells, axis))
    caption = "Best fitness of each generation: mean over the runs, with 95 % intervals as bands."
    page.figure(f"{name}-learning", caption, partial(draw_learning, study.cells))
    for what, values in (("fitness", _fitness), ("success", _success)):
        _pairs(page, study.cells, name, what, values, level)


def axes_of(cells: Sequence[Cell]) -> list[str]:
    """Axes on which the conditions differ."""
    axes = [axis for axis, _ in cells[0].condition.settings]
    return [axis for axis in axes if len({value_of(cell, axis) for cell in cells}) > 1]


def value_of(cell: Cell, axis: str) -> str:
    """Where a condition is on an axis, for people."""
    return setting_text(axis, dict(cell.condition.settings)[axis])


def definition(study: StudyData) -> list[str]:
    """The study's file, to be run again."""
    document = {"name": study.name, "about": study.about, "runs": min(cell.n for cell in study.cells), **study.written}
    return yaml.safe_dump(document, sort_keys=False, allow_unicode=True).splitlines()


def _conditions_table(cells: Sequence[Cell]) -> tuple[list[str], list[list[str]]]:
    rows = []
    for cell in cells:
        fitness = "" if cell.n < 2 else _shown(cell)
        rows.append([cell.condition.label, f"{cell.n}", fitness, percent(wilson(*cell.rate))])
    return ["condition", "runs", "best fitness: mean [95 %]", "success: % [95 %]"], rows


def _shown(cell: Cell) -> str:
    interval = mean_interval(cell.fitness)
    return f"{interval.estimate:.4g} [{interval.low:.4g}, {interval.high:.4g}]"


def _pairs(page: Page, cells: Sequence[Cell], name: str, what: str, values: _Values, level: int) -> None:
    if len(cells) < 2:
        return
    tables = list(_groups(cells, values))
    everything = [value for _, groups in tables for group in groups.values() for one in group for value in one]
    if min(everything) == max(everything):
        page.text(f"Pairwise tests of the {what} say nothing: it is the same in every run.")
        return
    page.heading(f"Which conditions differ: {what}", level)
    if what == "fitness":
        page.text(
            "Each pair once. *Difference* with its 95 % interval (Welch; of success rates Newcombe); *d*: in standard "
            "deviations of a run; *A*: probability that a run of the first is better than one of the second; *p* "
            "(Welch; of success rates Fisher) after Holm's correction for the pairs of a table. We *cannot tell* where "
            f"p is 0.05 or more, or a condition has fewer than {FEWEST_RUNS} runs: *more runs* says how many more of "
            "each condition would show a difference as large as the one that was measured, with 80 % probability."
        )
    for axis, groups in tables:
        if axis:
            page.text(f"By `{axis}` (means over the other axes):")
        suffix = f"-{file_name(axis)}" if axis else ""
        page.data_table(f"{name}-{what}-pairs{suffix}", *_pairs_table(all_pairs(groups, rates=what == "success")))


def _groups(cells: Sequence[Cell], values: _Values) -> Iterator[tuple[str, dict[str, list[NDArray[np.float64]]]]]:
    """What is compared: all conditions, or the values of each axis where there are too many."""
    if len(cells) <= MOST_IN_PAIRS:
        yield "", {cell.condition.label: [values(cell)] for cell in cells}
        return
    for axis in axes_of(cells):
        groups: dict[str, list[NDArray[np.float64]]] = {}
        for cell in cells:
            groups.setdefault(value_of(cell, axis), []).append(values(cell))
        yield axis, groups


def _pairs_table(pairs: Sequence[Pair]) -> tuple[list[str], list[list[str]]]:
    header = ["first", "second", "difference [95 %]", "d", "A", "p", "first is", "more runs"]
    return header, [_pair_row(pair) for pair in pairs]


def _pair_row(pair: Pair) -> list[str]:
    interval = pair.difference
    more = f"more than {MOST_RUNS:,}" if pair.more_runs is None else f"{pair.more_runs:,}"
    if pair.verdict != "cannot tell" or interval.estimate == 0.0:
        more = ""
    return [
        pair.one,
        pair.other,
        f"{interval.estimate:+.3g} [{interval.low:+.3g}, {interval.high:+.3g}]",
        f"{pair.effect:+.2f}",
        f"{pair.superiority:.2f}",
        f"{pair.p_corrected:.2g}",
        f"**{pair.verdict}**" if pair.verdict != "cannot tell" else pair.verdict,
        more,
    ]


def _fitness(cell: Cell) -> NDArray[np.float64]:
    return cell.fitness


def _success(cell: Cell) -> NDArray[np.float64]:
    return cell.succeeded.astype(np.float64)

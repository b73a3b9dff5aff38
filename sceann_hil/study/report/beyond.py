"""What the paper's authors could not do: exact landscapes, and controllers in disturbed bodies."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from sceann_hil.network.coding import Coding
from sceann_hil.network.controller import Neuron
from sceann_hil.study.landscape import Landscape, Summary, analyse, champion_ranks
from sceann_hil.study.report.cells import Cell, Key, StudyData
from sceann_hil.study.report.more_figures import draw_landscapes, draw_robustness
from sceann_hil.study.report.page import Page
from sceann_hil.study.report.paper import SUCCESS_PERCENT
from sceann_hil.study.report.wording import percent
from sceann_hil.study.robustness import Robustness, measure
from sceann_hil.study.statistics import wilson

_MOST_CHAMPIONS = 60
_FEWEST_CHAMPIONS = 5
_MOST_GROUPS = 5


def landscape_section(page: Page, landscapes: Sequence[Landscape], studies: Iterable[StudyData]) -> None:
    """Every genome of short codings, the two readings of the neuron side by side, and where the GA's champions rank."""
    page.heading("Exact landscapes")
    page.text(
        "Every genome was tried, so these numbers have no error. *Random search* is the probability that as many "
        "random genomes as the GA evaluates contain a solution; *neighbours* are the solutions among the one-bit "
        "neighbours of a solution, and in brackets how many there would be if solutions lay anywhere."
    )
    landscapes = _different(landscapes)
    found = {landscape.directory: analyse(landscape) for landscape in landscapes}
    rows = [_landscape_row(landscape, found[landscape.directory]) for landscape in sorted(landscapes, key=_order)]
    header = ["task", "coding", "(N_s,N_h)", "neuron", "genomes", "solutions", "best", "neighbours", "random search"]
    page.table(header, rows)
    ours = [landscape for landscape in landscapes if _is_the_paper_s(landscape)]
    if ours:
        caption = (
            "Part of all SCEANN3 genomes that balance at least so long, by reading of Eq. (1). Dotted: the 3,000 steps "
            "that count as success."
        )
        page.figure("landscapes", caption, partial(draw_landscapes, ours))
        page.text(_readings(ours, found))
    zeros = [landscape for landscape in landscapes if _explains_a_zero(landscape, found[landscape.directory])]
    if zeros:
        names = ", ".join(f"({one.config.size.n_sensors},{one.config.size.n_hidden})" for one in zeros)
        page.text(
            f"No genome at all balances with {names}: the zeros that Tables I and II print there are not bad luck in "
            "50 runs, they are exact for every algorithm."
        )
    ranks = list(_rank_rows(landscapes, list(studies), found))
    if ranks:
        page.text("Where the champions of the studies rank among all genomes (1 is best; equal fitness, equal rank):")
        page.table(
            ["landscape", "algorithm", "GA succeeds: % [95 %]", "random search: %", "champions' rank: median", "worst"],
            ranks,
        )


def _different(landscapes: Sequence[Landscape]) -> list[Landscape]:
    """One landscape for each experiment, whatever its algorithm: two studies may have enumerated the same one."""
    known: list[tuple[object, ...]] = []
    kept = []
    for landscape in landscapes:
        config = landscape.config
        repeats = config.robot.spec.noise_free and not config.build_task().draws_starts
        key = (config.task, config.robot, config.controller, 0 if repeats else config.seed)
        if key not in known:
            known.append(key)
            kept.append(landscape)
    return kept


def _order(landscape: Landscape) -> tuple[str, str, int, int, str]:
    config = landscape.config
    size, controller = config.size, config.controller
    return config.task.type, controller.coding.value, size.n_sensors, size.n_hidden, controller.neuron.value


def _landscape_row(landscape: Landscape, summary: Summary) -> list[str]:
    config = landscape.config
    size = config.size
    neighbours = f"{summary.neighbours_mean:.2f} of {summary.length} ({summary.neighbours_expected:.2g})"
    return [
        config.task.type.replace("_", " "),
        config.controller.coding.name,
        f"({size.n_sensors},{size.n_hidden})",
        config.controller.neuron.value,
        f"2^{summary.length}",
        f"**{summary.n_solutions:,}**" + (f" ({summary.fraction:.2g})" if summary.n_solutions else ""),
        f"{summary.best_fitness:.4g}",
        neighbours if summary.n_solutions else "",
        f"{100 * summary.random_search:.3g} %" if summary.n_solutions else "0",
    ]


def _explains_a_zero(landscape: Landscape, summary: Summary) -> bool:
    """A network for which both tables print 0, and rightly so."""
    config = landscape.config
    size, controller = config.size, config.controller
    printed = [SUCCESS_PERCENT.get(Key(controller.coding, a, size.n_sensors, size.n_hidden)) for a in ("sga", "oga")]
    return (
        config.task.type == "pole_balancing"
        and controller.neuron is Neuron.ACCUMULATING
        and printed == [0, 0]
        and summary.n_solutions == 0
    )


def _is_the_paper_s(landscape: Landscape) -> bool:
    config = landscape.config
    return (
        config.task.type == "pole_balancing"
        and config.controller.coding is Coding.SCEANN3
        and config.size.n_sensors == 2
    )


def _readings(landscapes: Sequence[Landscape], found: Mapping[Path, Summary]) -> str:
    def solutions(neuron: Neuron) -> int:
        mine = [found[one.directory].n_solutions for one in landscapes if one.config.controller.neuron is neuron]
        return sum(mine)

    accumulating, memoryless = solutions(Neuron.ACCUMULATING), solutions(Neuron.MEMORYLESS)
    return (
        f"Read to the letter (*memoryless*: the state is the sum of the current inputs), {memoryless:,} of these "
        f"genomes balance the pole; if the state *accumulates* its inputs, {accumulating:,} do. The paper reports "
        "successes with (2,3), so only the accumulating reading can be meant: this is the evidence for `neuron: "
        "accumulating`."
    )


def _rank_rows(
    landscapes: Sequence[Landscape], studies: Sequence[StudyData], found: Mapping[Path, Summary]
) -> Iterable[list[str]]:
    for landscape in sorted(landscapes, key=_order):
        known: set[str] = set()
        for cell in (cell for study in studies for cell in study.cells):
            ours, theirs = landscape.config, cell.condition.config
            same = (ours.task, ours.robot, ours.controller) == (theirs.task, theirs.robot, theirs.controller)
            algorithm = theirs.algorithm
            if not same or algorithm.type in known or algorithm.model_dump(exclude_defaults=True):
                continue
            known.add(algorithm.type)
            ranks = champion_ranks(landscape, cell.runs.genomes)
            summary = found[landscape.directory]
            controller, size = ours.controller, ours.size
            yield [
                f"{ours.task.type.replace('_', ' ')}, {controller.coding.name} ({size.n_sensors},{size.n_hidden})",
                algorithm.type.upper(),
                percent(wilson(*cell.rate)),
                f"{100 * summary.random_search:.3g}",
                f"{int(np.median(ranks)):,} of {summary.n_genomes:,}",
                f"{int(ranks.max()):,}",
            ]


def robustness_section(page: Page, tables: StudyData | None, fig6: StudyData | None) -> None:
    """Success of champions in disturbed bodies."""
    page.heading("Robustness: which champion to put on a robot")
    page.text(
        "Champions that succeeded in the ideal body were run again in bodies that differ from it. Solid: mean of the "
        "champions of a network; dashed: the one with the best mean over all disturbances, which "
        "`sceann champion DIR --robust --by success` picks."
    )
    if tables is not None:
        groups = _pole_groups(tables.by_key)
        if groups:
            caption = "Pole balancing: SCEANN3 champions of both algorithms against disturbance."
            page.figure("robustness-pole", caption, partial(draw_robustness, groups))
            page.text(_most_robust(groups))
    if fig6 is not None:
        groups = _goal_groups(fig6.by_key)
        if groups:
            caption = "Goal reach: champions of the fittest network of each coding (OGA) against disturbance."
            page.figure("robustness-goal", caption, partial(draw_robustness, groups))
            page.text(_most_robust(groups))


def _pole_groups(cells: Mapping[Key, Cell]) -> dict[str, tuple[Robustness, int]]:
    members: dict[str, list[Cell]] = {}
    for key, cell in cells.items():
        if key.coding is Coding.SCEANN3 and cell.succeeded.any():
            members.setdefault(f"({key.n_sensors},{key.n_hidden})", []).append(cell)
    return _measured(members)


def _goal_groups(cells: Mapping[Key, Cell]) -> dict[str, tuple[Robustness, int]]:
    members: dict[str, list[Cell]] = {}
    for coding in Coding:
        mine = {key: cell for key, cell in cells.items() if key.coding is coding and key.algorithm == "oga"}
        if mine:
            best = max(mine, key=lambda key: float(mine[key].fitness.mean()))
            members[f"{coding.name} ({best.n_sensors},{best.n_hidden})"] = [mine[best]]
    return _measured(members)


def _measured(members: Mapping[str, Sequence[Cell]]) -> dict[str, tuple[Robustness, int]]:
    groups: dict[str, tuple[Robustness, int]] = {}
    for name, cells in members.items():
        genomes = {cell.runs.genomes[k]: cell.genome(int(k)) for cell in cells for k in np.flatnonzero(cell.succeeded)}
        chosen = list(genomes.values())[:_MOST_CHAMPIONS]
        if len(chosen) >= _FEWEST_CHAMPIONS:
            groups[name] = measure(cells[0].condition.config, np.stack(chosen)), len(chosen)
    most = sorted(groups, key=lambda name: -float(groups[name][0].score.mean()))[:_MOST_GROUPS]
    return {name: groups[name] for name in groups if name in most}


def _most_robust(groups: Mapping[str, tuple[Robustness, int]]) -> str:
    by_mean = max(groups, key=lambda name: float(groups[name][0].score.mean()))
    by_best = max(groups, key=lambda name: float(groups[name][0].score.max()))
    return (
        f"Most robust on average: {by_mean}, whose champions succeed in "
        f"{groups[by_mean][0].score.mean():.0%} of all disturbed trials; the best single champion is one of {by_best} "
        f"({groups[by_best][0].score.max():.0%})."
    )

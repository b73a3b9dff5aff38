"""The report of one run: how it went, its champion, and the map of different controllers if there is one."""

from __future__ import annotations

import shlex
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np

from sceann_hil.config import ExperimentConfig, journalled_config
from sceann_hil.errors import NotARun
from sceann_hil.evolution.algorithm import Archive
from sceann_hil.journal import JOURNAL_NAME, GenerationRow, JournalReader
from sceann_hil.network.coding import genome_to_hex
from sceann_hil.run.archive import archive_of
from sceann_hil.run.champion import champion_of
from sceann_hil.study.report.page import Page
from sceann_hil.study.style import BLUE, ORANGE, drawing, save
from sceann_hil.versions import PROGRAM, running_versions

NAME = "report"
_MOST_ROWS = 20
"""Of the table of a map's controllers."""


def is_a_run(directory: Path) -> bool:
    """Whether this is the folder of a single run."""
    return (directory / JOURNAL_NAME).exists()


def run_page(directory: Path, out: Path) -> Page:
    """The page, not yet written.

    Args:
        directory: of the run.
        out: where the page goes.

    Raises:
        NotARun: no generation is finished yet.
        RunIsNewer, RunIsDamaged: the journal cannot be read.
    """
    with closing(JournalReader(directory)) as reader:
        rows, config = reader.generations(finished=True), journalled_config(reader)
        if not rows:
            raise NotARun(f"{directory} has no finished generation yet.", "`sceann resume` it first.")
        page = Page(f"Run {reader.run().name}", out, NAME)
        champion = champion_of(reader, keeps_best=config.algorithm.keeps_best)
        n_trials = sum(row.attempts or 0 for row in rows)
        page.text(
            f"Task `{config.task.type}`, robot `{config.robot.type}`, coding {config.controller.coding.name}, "
            f"algorithm `{config.algorithm.type}`: {len(rows)} generations of {config.algorithm.population} "
            f"individuals, {n_trials:,} trials."
        )
        if champion is not None and champion.fitness is not None:
            page.text(f"The champion has fitness {champion.fitness:.4g}; its genome is `{champion.genome}`.")
        page.heading("Fitness")
        page.figure("fitness", "Best and mean fitness of each generation.", partial(_draw_fitness, rows))
        archive = archive_of(reader, config)
        if archive is not None and len(archive.fitness):
            _map_section(page, archive, config)
        page.heading("How this was made")
        page.text(f"`sceann report {shlex.quote(str(directory))}`, sceann-hil {running_versions()[PROGRAM]}.")
        return page


def _map_section(page: Page, archive: Archive, config: ExperimentConfig) -> None:
    page.heading("Different controllers")
    n_cells = int(np.prod(archive.cells))
    further = f", the best of all cells along {', '.join(archive.names[2:])}" if len(archive.names) > 2 else ""
    page.text(
        f"{len(archive.fitness)} of {n_cells} cells are filled ({len(archive.fitness) / n_cells:.0%}); sum of their "
        f"fitness {archive.fitness.sum():.4g}. It is the map that the newest generation came from."
    )
    caption = (
        f"The best fitness of each cell{further}; cells without a controller are white. The axes are what a controller "
        "did, mean over its trials."
    )
    from sceann_hil.study.report.map_figure import draw_map

    page.figure("map", caption, partial(draw_map, archive))
    best = np.argsort(-archive.fitness, kind="stable")
    page.data_table(
        "map-cells",
        [*archive.names, "fitness", "genome"],
        [
            [*(f"{value:.4g}" for value in archive.measures[i]), f"{archive.fitness[i]:.4g}", genome_to_hex(genome)]
            for i, genome in zip(best.tolist(), archive.genomes[best], strict=True)
        ][:_MOST_ROWS],
    )
    if len(best) > _MOST_ROWS:
        page.text(f"The {_MOST_ROWS} best of {len(best)}; all of them: `sceann_hil.open(DIR).archive()`.")


def _draw_fitness(rows: list[GenerationRow], path: Path) -> None:
    with drawing(14.0, 7.5) as figure:
        axes = figure.subplots()
        numbers = [row.number for row in rows]
        axes.plot(numbers, [row.best_fitness or 0.0 for row in rows], color=BLUE, label="best")
        axes.plot(numbers, [row.mean_fitness or 0.0 for row in rows], color=ORANGE, label="mean")
        axes.set(xlabel="generation", ylabel="fitness")
        axes.legend()
        save(figure, path)

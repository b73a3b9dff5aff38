"""The whole report of a folder of studies."""

from __future__ import annotations

import platform
from collections.abc import Sequence
from pathlib import Path

from sceann_hil.errors import NotARun
from sceann_hil.study.landscape import Landscape, landscapes_in
from sceann_hil.study.report import prose
from sceann_hil.study.report.beyond import landscape_section, robustness_section
from sceann_hil.study.report.cells import Cell, StudyData, studies_in
from sceann_hil.study.report.claims import Claim
from sceann_hil.study.report.goal import fig6_section
from sceann_hil.study.report.page import Page
from sceann_hil.study.report.pole import best_section, fig10_section, tables_section
from sceann_hil.study.report.sensitivity import PREFIX, sensitivity_section
from sceann_hil.study.report.wording import percent, runs_sentence, verdict_text
from sceann_hil.study.statistics import Verdict, mean_interval, wilson
from sceann_hil.timespans import duration_text

NAME = "reproduction"
_CONFIGS = "configs/paper"
_PAPER = ("tables", "fig10", "fig6")


def write_report(directory: Path, out: Path) -> tuple[Path, Path]:
    """Tables, figures and claims of all studies and landscapes in a folder.

    Args:
        directory: a study's folder, or one that holds several.
        out: where ``reproduction.md``, ``reproduction.html`` and the folder ``reproduction`` go.

    Returns:
        The Markdown and the HTML file.

    Raises:
        NotARun: there is neither a study nor a landscape in the folder.
        RunIsNewer, RunIsDamaged: a database cannot be read.
    """
    studies = {name: study for name, study in studies_in(directory).items() if study.cells}
    landscapes = landscapes_in(directory)
    if not studies and not landscapes:
        raise NotARun(
            f"{directory} holds neither a study with results nor a landscape.",
            "Name the folder that `sceann study` or `sceann enumerate` printed (its --out).",
        )
    body = Page("", out, NAME)
    claims: list[Claim] = []
    if "tables" in studies:
        claims += tables_section(body, studies["tables"])
    if "fig10" in studies:
        claims += fig10_section(body, studies["fig10"])
    if "tables" in studies or "fig10" in studies:
        claims += best_section(body, (studies.get("tables") or studies["fig10"]).by_key)
    if "fig6" in studies:
        claims += fig6_section(body, studies["fig6"])
    if landscapes:
        landscape_section(body, landscapes, studies.values())
    variations = [study for name, study in studies.items() if name.startswith(PREFIX)]
    if variations:
        body.heading("Sensitivity: what the open choices matter")
        for study in variations:
            sensitivity_section(body, study)
    if "tables" in studies or "fig6" in studies:
        robustness_section(body, studies.get("tables"), studies.get("fig6"))
    for name, study in studies.items():
        if name not in _PAPER and not name.startswith(PREFIX):
            _other_study(body, study)
    page = Page("The paper, reproduced", out, NAME)
    _summary(page, claims, list(studies.values()))
    page.append(body)
    _how_made(page, list(studies.values()), landscapes)
    return page.write()


def _summary(page: Page, claims: Sequence[Claim], studies: Sequence[StudyData]) -> None:
    page.text(prose.WHAT_THIS_IS)
    if claims:
        page.heading("Every claim at a glance")
        page.text(prose.HOW_CLAIMS_ARE_TESTED)
        counts = ", ".join(f"*{verdict}* {sum(c.verdict is verdict for c in claims)}" for verdict in Verdict)
        page.text(f"Of {len(claims)} claims: {counts}.")
        page.table(["", "claim", "verdict"], [[c.number, c.text, verdict_text(c.verdict)] for c in claims])
    page.heading("What the paper leaves open and how it is read here")
    page.bullets(prose.READINGS)
    missing = [name for name in _PAPER if name not in {study.name for study in studies}]
    if missing:
        page.text("Not in this report, because their studies were not run: " + ", ".join(missing) + ".")


def _other_study(page: Page, study: StudyData) -> None:
    page.heading(f"Study {study.name}")
    page.text(study.about, runs_sentence(study))
    rows = []
    for cell in study.cells:
        fitness = "" if cell.n < 2 else _interval_text(cell)
        rows.append([cell.condition.label, f"{cell.n}", fitness, percent(wilson(*cell.rate))])
    page.table(["condition", "runs", "best fitness: mean [95 %]", "success: % [95 %]"], rows)


def _interval_text(cell: Cell) -> str:
    interval = mean_interval(cell.fitness)
    return f"{interval.estimate:.4g} [{interval.low:.4g}, {interval.high:.4g}]"


def _how_made(page: Page, studies: Sequence[StudyData], landscapes: Sequence[Landscape]) -> None:
    page.heading("How this was made")
    page.text(prose.HOW_TO_REPEAT)
    enumerated = dict.fromkeys(landscape.directory.parent.parent.name for landscape in landscapes)
    page.code(
        [
            *(
                f"sceann study {_CONFIGS}/{s.name}.yaml --runs {min(c.n for c in s.cells)} --out studies"
                for s in studies
            ),
            *(f"sceann enumerate {_CONFIGS}/{name}.yaml --out studies" for name in enumerated),
            "sceann report studies --out docs",
        ]
    )
    rows = [
        [
            f"`{study.name}`",
            f"{len(study.cells)}",
            study.n_runs,
            f"{study.seed}",
            duration_text(study.effort.wall_s),
            ", then ".join(study.effort.workers),
        ]
        for study in studies
    ]
    page.table(["study", "conditions", "runs each", "seed", "wall-clock time", "computed by"], rows)
    if studies:
        versions = ", ".join(f"{name} {number}" for name, number in studies[0].versions.items() if name != "machine")
        page.text(f"Made with {versions}; {platform.system()} {platform.machine()}. {prose.ABOUT_TIMES}")

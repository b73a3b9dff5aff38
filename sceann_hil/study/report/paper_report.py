"""The report of the paper's own studies: every table, figure and claim with our numbers beside it."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from pathlib import Path

from sceann_hil.study.landscape import Landscape
from sceann_hil.study.report import prose
from sceann_hil.study.report.beyond import landscape_section, robustness_section
from sceann_hil.study.report.cells import StudyData
from sceann_hil.study.report.claims import Claim
from sceann_hil.study.report.goal import fig6_section
from sceann_hil.study.report.own import study_section
from sceann_hil.study.report.page import Page
from sceann_hil.study.report.pole import best_section, fig10_section, tables_section
from sceann_hil.study.report.sensitivity import PREFIX, sensitivity_section
from sceann_hil.study.report.wording import verdict_text
from sceann_hil.study.statistics import Verdict
from sceann_hil.timespans import duration_text

NAME = "reproduction"
_CONFIGS = "configs/paper"
_TASK_OF = {"tables": "pole_balancing", "fig10": "pole_balancing", "fig6": "goal_reach"}


def is_of_the_paper(study: StudyData) -> bool:
    """One of the paper's grids: by its name, its task, and coordinates that tell its conditions apart."""
    task = _TASK_OF.get(study.name)
    same = all(cell.condition.config.task.type == task for cell in study.cells)
    return task is not None and same and len(study.by_key) == len(study.cells)


def paper_page(studies: Mapping[str, StudyData], landscapes: Sequence[Landscape], out: Path) -> Page:
    """The whole page.

    Args:
        studies: by name; at least one of the paper's.
        landscapes: complete ones.
        out: where the page will be written.
    """
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
        if name not in _TASK_OF and not name.startswith(PREFIX):
            body.heading(f"Study {study.name}")
            study_section(body, study, level=3)
    page = Page("The paper, reproduced", out, NAME)
    _summary(page, claims, list(studies.values()))
    page.append(body)
    _how_made(page, list(studies.values()), landscapes)
    return page


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
    missing = [name for name in _TASK_OF if name not in {study.name for study in studies}]
    if missing:
        page.text("Not in this report, because their studies were not run: " + ", ".join(missing) + ".")


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

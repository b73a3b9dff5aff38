"""The whole report of a folder of studies: the paper's, if they are its studies, and else one of their own."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from sceann_hil.errors import NotARun
from sceann_hil.study.landscape import Landscape, landscapes_in
from sceann_hil.study.report import prose
from sceann_hil.study.report.beyond import landscape_section
from sceann_hil.study.report.cells import StudyData, studies_in
from sceann_hil.study.report.own import definition, study_section
from sceann_hil.study.report.page import Page
from sceann_hil.study.report.paper_report import is_of_the_paper, paper_page
from sceann_hil.study.report.run_page import is_a_run, run_page
from sceann_hil.versions import PROGRAM, running_versions

NAME = "report"


def write_report(directory: Path, out: Path) -> tuple[Path, Path]:
    """Tables, figures and tests of all studies and landscapes in a folder, or of a single run.

    Args:
        directory: a study's folder, one that holds several, or a run's.
        out: where the page goes, as Markdown and as HTML, with a folder of figures and tables beside it. They are
            called ``reproduction`` if the paper's studies are there, else ``report``.

    Returns:
        The Markdown and the HTML file.

    Raises:
        NotARun: there is neither a study nor a landscape in the folder, nor a run with a finished generation.
        RunIsNewer, RunIsDamaged: a database cannot be read.
    """
    if is_a_run(directory):
        return run_page(directory, out).write()
    studies = {name: study for name, study in studies_in(directory).items() if study.cells}
    landscapes = landscapes_in(directory)
    if not studies and not landscapes:
        raise NotARun(
            f"{directory} holds neither a study with results nor a landscape nor a run.",
            "Name the folder that `sceann study`, `sceann enumerate` or `sceann evolve` printed (its --out).",
        )
    if any(is_of_the_paper(study) for study in studies.values()):
        page = paper_page(studies, landscapes, out)
    else:
        page = _own_page(list(studies.values()), landscapes, out)
    return page.write()


def _own_page(studies: Sequence[StudyData], landscapes: Sequence[Landscape], out: Path) -> Page:
    title = studies[0].name if len(studies) == 1 else "Studies: " + ", ".join(study.name for study in studies)
    page = Page(title if studies else "Exact landscapes", out, NAME)
    for study in studies:
        if len(studies) > 1:
            page.heading(f"Study {study.name}")
        study_section(page, study, level=2 if len(studies) == 1 else 3)
    if landscapes:
        landscape_section(page, landscapes, studies)
    page.heading("How this was made")
    for study in studies:
        file = f"{study.name}.yaml"
        page.text(f"`{file}`, to be run with `sceann study {shlex.quote(file)}`:")
        page.code(definition(study), "yaml")
    began = [", ".join(f"{name} {number}" for name, number in study.versions.items()) for study in studies]
    for study, versions in zip(studies, began, strict=True):
        page.text(f"Study `{study.name}` was begun with {versions}.")
    page.text(f"This page was written by sceann-hil {running_versions()[PROGRAM]}.", prose.HOW_TO_CITE)
    return page

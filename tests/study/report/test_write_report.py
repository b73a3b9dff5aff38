"""A report of small studies in the paper's grids: everything is there, and the page stands alone."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest

from sceann_hil.errors import NotARun
from sceann_hil.study import Block, BlockResult, compute_block, load_conditions, load_study, run_study
from sceann_hil.study.landscape import enumerate_landscape
from sceann_hil.study.report import write_report
from sceann_hil.study.report.cells import StudyData
from sceann_hil.study.report.sensitivity import variants_of

PAPER = Path(__file__).parents[3] / "configs" / "paper"


class Here:
    count = 1
    description = "the test"

    def compute(self, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        return map(compute_block, blocks)


def run(name: str, out: Path, *overrides: str) -> None:
    study = load_study(PAPER / f"{name}.yaml", ["runs=2", *overrides])
    run_study(study, out / name, Here())


SHORT = "base.algorithm={type: sga, population: 4, generations: 1, mutation_rate: 0.05}"


@pytest.fixture(scope="module")
def studies(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("studies")
    run("tables", out, "base.task={type: pole_balancing, max_steps: 40}", SHORT)
    run("fig10", out, "base.task={type: pole_balancing, max_steps: 40}", SHORT)
    run("fig6", out, "base.task={type: goal_reach, max_steps: 60, headings_deg: [0.0, 90.0]}", SHORT)
    run("sensitivity-euler", out, "base.task={type: pole_balancing, max_steps: 40}", SHORT)
    shorter = ["grid={controller.neuron: [accumulating, memoryless]}", "base.controller={coding: sceann3, n_hidden: 2}"]
    _, conditions = load_conditions(
        PAPER / "landscape.yaml", [*shorter, "base.task={type: pole_balancing, max_steps: 40}"]
    )
    for condition in conditions:
        enumerate_landscape(condition.config, out / "landscape" / condition.config.controller.neuron.value, 2)
    return out


@pytest.fixture(scope="module")
def report(studies: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str, Path]:
    out = tmp_path_factory.mktemp("report")
    markdown, page = write_report(studies, out)
    return markdown.read_text(encoding="utf-8"), page.read_text(encoding="utf-8"), out


def test_every_table_and_figure_of_the_paper_is_there(report: tuple[str, str, Path]) -> None:
    markdown, _, out = report
    for heading in ("Table I: SGA", "Table II: OGA", "Fig. 6", "Fig. 7", "Fig. 8", "Fig. 10", "Fig. 11", "Fig. 12"):
        assert heading in markdown
    for figure in re.findall(r"\]\((reproduction/[^)]*)\)", markdown):
        assert (out / figure).stat().st_size > 1000
        assert (out / figure).with_suffix(".png").stat().st_size > 1000
    figures = {path.stem for path in (out / "reproduction").glob("*.svg")}
    assert {"fig6", "fig7", "fig8", "fig10", "fig11", "fig12", "landscapes", "sensitivity-euler"} <= figures


def test_every_claim_has_a_verdict_at_a_glance_and_with_its_evidence(report: tuple[str, str, Path]) -> None:
    markdown, _, _ = report
    verdicts = re.findall(r"^\| ([TPG][^|]*) \| .*\*\*(?:✓ holds|✗ does not hold|\? cannot tell)\*\*", markdown, re.M)
    for number in (
        "T I",
        "T II",
        "P1",
        "P2",
        "P3a",
        "P4a",
        "P5b",
        "P6b",
        "P7",
        "P8",
        "G1a",
        "G2b",
        "G3b",
        "G5b",
        "G6a",
        "G7",
    ):
        assert verdicts.count(number) == 2
    assert sum(number.startswith("G4") for number in verdicts) == 20


def test_the_paper_s_numbers_stand_beside_ours(report: tuple[str, str, Path]) -> None:
    markdown, _, _ = report
    assert "| 2 | 3 | 44 [31.2, 57.7] | **" in markdown
    assert "| 4 | 3 | 12 [5.62, 23.8] | **" in markdown


def test_the_page_needs_nothing_beside_it(report: tuple[str, str, Path]) -> None:
    _, page, _ = report
    sources = re.findall(r'src="([^"]{0,40})', page)
    assert len(sources) >= 8
    assert all(source.startswith("data:image/svg+xml;base64,") for source in sources)
    assert "<table>" in page
    assert "http" not in re.sub(r"base64,[^\"]*", "", page)


def test_the_two_readings_stand_side_by_side(report: tuple[str, str, Path]) -> None:
    markdown, _, _ = report
    rows = [line for line in markdown.splitlines() if line.startswith("| pole balancing | SCEANN3 | (2,2)")]
    assert ["accumulating" in row for row in rows] == [True, False]


def test_a_study_that_was_not_run_is_named(studies: Path, tmp_path: Path) -> None:
    markdown, _ = write_report(studies / "tables", tmp_path)
    text = markdown.read_text(encoding="utf-8")
    assert "Not in this report, because their studies were not run: fig10, fig6." in text
    assert "Table I: SGA" in text


def test_any_other_study_gets_a_table_of_its_conditions(studies: Path, tmp_path: Path) -> None:
    run("sensitivity-initial", tmp_path, "name=mine", "base.task={type: pole_balancing, max_steps: 40}", SHORT)
    text = write_report(tmp_path, tmp_path / "out")[0].read_text(encoding="utf-8")
    assert text.startswith("# mine\n")
    assert "| initial_output=0.25, oga, n_hidden=4 | 2 |" in text


def test_a_variant_is_compared_with_the_default_of_its_algorithm(studies: Path) -> None:
    variants = variants_of(StudyData.read(studies / "sensitivity-euler"))
    assert [variant.name for variant in variants] == [
        "SGA, integrator=euler (default)",
        "SGA, integrator=semi_implicit_euler",
        "OGA, integrator=euler (default)",
        "OGA, integrator=semi_implicit_euler",
    ]
    assert [variant.difference is None for variant in variants] == [True, False, True, False]


def test_a_folder_without_studies_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NotARun, match="neither a study with results nor a landscape"):
        write_report(tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()

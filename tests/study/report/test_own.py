"""The report of a study of one's own: its title and words, every axis, and nothing that was not run."""

from __future__ import annotations

import csv
import re
from pathlib import Path

import pytest
import yaml

from sceann_hil.study import load_study, parse_study, run_study
from sceann_hil.study.report import write_report
from tests.study.report.test_write_report import PAPER, SHORT, Here

STUDY = """\
name: Hidden neurons v1.2
about: "Does <b>more</b> help? <script>alert(1)</script>"
seed: 5
runs: RUNS
base:
  task: {type: pole_balancing, max_steps: 60}
  robot: {type: cartpole}
  controller: {coding: sceann3, n_hidden: 2}
  algorithm: {type: sga, population: 6, generations: 3}
grid:
  controller.n_hidden: [1, 2]
  controller.coding: [sceann1, sceann3]
"""


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, str, Path]:
    folder = tmp_path_factory.mktemp("own")
    run_study(parse_study(STUDY.replace("RUNS", "12"), "test"), folder / "studies" / "mine", Here())
    markdown, page = write_report(folder / "studies", folder / "out")
    return markdown.read_text(encoding="utf-8"), page.read_text(encoding="utf-8"), folder / "out"


def test_it_has_its_own_title_and_says_nothing_of_the_paper_s_claims(written: tuple[str, str, Path]) -> None:
    markdown, page, _ = written
    assert markdown.startswith("# Hidden neurons v1.2\n")
    assert "<title>Hidden neurons v1.2</title>" in page
    for word in ("reproduced", "configs/paper", "✓ holds", "Table I", "What the paper leaves open"):
        assert word not in markdown


def test_what_a_person_wrote_is_text_in_the_page(written: tuple[str, str, Path]) -> None:
    _, page, _ = written
    assert "<script>" not in page
    assert "<b>more" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page


def test_there_are_figures_of_every_axis_and_learning_curves(written: tuple[str, str, Path]) -> None:
    markdown, page, out = written
    figures = re.findall(r"!\[[^]]*\]\((report/[^)]*\.svg)\)", markdown)
    assert len(set(figures)) == 3
    assert {"n_hidden", "coding", "learning"} == {re.split("[-.]", figure)[-2] for figure in figures}
    for figure in figures:
        assert (out / figure).stat().st_size > 1000
        assert (out / figure).with_suffix(".png").stat().st_size > 1000
    assert page.count("data:image/svg+xml;base64,") == 3


def test_tables_are_files_too(written: tuple[str, str, Path]) -> None:
    markdown, _, out = written
    tables = re.findall(r"\]\((report/[^)]*\.(?:csv|tex))\)", markdown)
    assert len(tables) == 6
    (conditions,) = [out / name for name in tables if name.endswith("conditions.csv")]
    with conditions.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["runs"] for row in rows] == ["12"] * 4
    assert rows[0]["condition"] == "n_hidden=1, coding=sceann1"
    latex = conditions.with_suffix(".tex").read_text(encoding="utf-8")
    assert latex.startswith("% sceann-hil ")
    assert r"n\_hidden=1, coding=sceann1 & 12" in latex
    assert latex.count(r"\\") == 5
    for name in tables:
        assert "**" not in (out / name).read_text(encoding="utf-8")


def test_the_study_s_own_file_is_there_to_be_run_again(written: tuple[str, str, Path]) -> None:
    markdown, _, _ = written
    text = markdown.split("```yaml\n")[1].split("```")[0]
    assert yaml.safe_load(text)["grid"] == {"controller.n_hidden": [1, 2], "controller.coding": ["sceann1", "sceann3"]}
    assert parse_study(text, "again").written == parse_study(STUDY.replace("RUNS", "12"), "test").written
    assert "sceann study 'Hidden neurons v1.2.yaml'" in markdown
    assert re.search(r"begun with sceann-hil [\d.]+", markdown)


def test_three_runs_tell_nothing(tmp_path: Path) -> None:
    run_study(parse_study(STUDY.replace("RUNS", "3"), "test"), tmp_path / "studies", Here())
    markdown, _ = write_report(tmp_path / "studies", tmp_path / "out")
    text = markdown.read_text(encoding="utf-8")
    assert "**higher**" not in text
    assert "**lower**" not in text
    assert "cannot tell" in text


def test_three_runs_of_the_paper_s_tables_agree_with_nothing(tmp_path: Path) -> None:
    """Our interval was [0, 56] % and the claim was said to hold."""
    task = "base.task={type: pole_balancing, max_steps: 40}"
    run_study(load_study(PAPER / "tables.yaml", ["runs=3", task, SHORT]), tmp_path / "tables", Here())
    text = write_report(tmp_path / "tables", tmp_path / "out")[0].read_text(encoding="utf-8")
    assert "agrees" not in re.sub(r"\*agrees\*", "", text)
    assert "✓ holds" not in "\n".join(line for line in text.splitlines() if line.startswith("| T"))


def test_a_study_of_one_s_own_called_like_the_paper_s_is_one_s_own(tmp_path: Path) -> None:
    text = STUDY.replace("Hidden neurons v1.2", "fig6").replace("RUNS", "2")
    run_study(parse_study(text, "test"), tmp_path / "studies", Here())
    markdown, _ = write_report(tmp_path / "studies", tmp_path / "out")
    assert markdown.name == "report.md"

"""The table of all runs below a folder: what it shows, its filters, and that no run can spoil it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from sceann_hil.cli import app
from tests.runs import GOAL, POLE, evolve

SMALL = ("algorithm.population=2", "algorithm.generations=1")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("class")
    evolve(folder / "anna" / "first", GOAL, *SMALL)
    evolve(folder / "ben" / "first", POLE, *SMALL)
    evolve(folder / "ben" / "second", POLE, *SMALL, "seed=5")
    damaged = folder / "<i>cut"
    damaged.mkdir()
    journal = (folder / "ben" / "first" / "journal.sqlite").read_bytes()
    (damaged / "journal.sqlite").write_bytes(journal[:100])
    (folder / "again").symlink_to(folder / "anna")
    (folder / "loop").symlink_to(folder)
    return folder


def listed(*arguments: object) -> list[dict[str, Any]]:
    done = CliRunner().invoke(app, ["runs", *map(str, arguments), "--json"])
    assert done.exit_code == 0, done.output
    document: list[dict[str, Any]] = json.loads(done.stdout)["runs"]
    return document


def test_every_run_is_there_once_and_a_damaged_one_says_why(folder: Path) -> None:
    runs = listed(folder)
    assert len(runs) == 4
    assert {run["state"] for run in runs} == {"finished", "unreadable"}
    (cut,) = [run for run in runs if run["state"] == "unreadable"]
    assert "journal.sqlite" in cut["problem"]
    for run in runs:
        if run["state"] == "finished":
            assert (run["generations"], run["generations_in_all"]) == (2, 2)
            assert run["trials"] > 0
            assert run["best_fitness"] is not None


@pytest.mark.parametrize(
    ("arguments", "n"),
    [
        (["--task", "pole_balancing"], 2),
        (["--robot", "diffdrive"], 1),
        (["--algorithm", "sga"], 2),
        (["--state", "unreadable"], 1),
        (["--state", "running", "--state", "stopped"], 0),
        (["--name", "ben/*"], 2),
        (["--name", "first", "--task", "pole*"], 1),
    ],
)
def test_filters(folder: Path, arguments: list[str], n: int) -> None:
    assert len(listed(folder, *arguments)) == n


def test_the_best_first(folder: Path) -> None:
    best = [run["best_fitness"] for run in listed(folder, "--sort", "best")]
    known = [value for value in best if value is not None]
    assert known == sorted(known, reverse=True)
    assert best[-1] is None


def test_the_page_shows_names_as_text(folder: Path, tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["runs", str(folder), "--page", str(tmp_path / "runs.html")])
    assert done.exit_code == 0, done.output
    page = (tmp_path / "runs.html").read_text(encoding="utf-8")
    assert "&lt;i&gt;cut" in page
    assert "<i>" not in page
    assert page.count("<tr") == 5


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["runs", str(tmp_path / "nowhere")])
    assert "no such folder" in str(done.exception)


def test_a_folder_without_runs(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["runs", str(tmp_path)])
    assert done.exit_code == 0
    assert "No such run" in done.output

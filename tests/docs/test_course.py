"""docs/course line by line: every command of the teacher's page and of every worksheet, in the order of the lessons."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

from backends.virtual.command import with_robot
from backends.virtual.power import switch_on
from sceann_hil.config import load_config
from sceann_hil.firmware.build import Board
from tests.pages import ROOT, commands_of, follow, only_late
from tests.terminal import terminal

COURSE = ROOT / "docs" / "course"
PAGES = ["README", *(f"worksheet-{number}" for number in (1, 2, 3, 4))]
SMALL = "--set algorithm.generations=1 --set task.max_steps=30 --record none"
FEW_TRIALS = "--record none --trials 2 --set uncertainty.robots=20 --set task.max_steps=15"


def shorter(words: list[str]) -> list[str]:
    """The page's own command, with less of everything."""
    if words[1] == "view":
        # a window is nothing for a test, and the pictures of runs have their own; the run must be there
        return ["sceann", "status", words[2]]
    if words[1] == "transfer":
        return [*words, *FEW_TRIALS.split()]
    if words[1] == "evolve":
        # what is watched needs a terminal
        return [] if "--watch" in words else [*words, *SMALL.split()]
    return words


@pytest.fixture
def lessons(tmp_path: Path) -> Path:
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    (tmp_path / "runs").mkdir()
    return tmp_path


@pytest.fixture
def unknown_robot(lessons: Path) -> Iterator[None]:
    """What the first terminal of worksheet 3 switches on."""
    line = re.search(
        r"^\$ sceann virtual posix (\S+) --seed 7 --port (\S+) --write (\S+)$", _text(PAGES[3]), re.MULTILINE
    )
    assert line is not None
    config = load_config(lessons / line[1])
    start = config.build_task().starts[0].tolist()
    with switch_on(Board.POSIX, config.robot, port=lessons / line[2], seed=7, start=start) as robot:
        (lessons / line[3]).write_text(with_robot(config, robot.section()), encoding="utf-8")
        yield


def _text(page: str) -> str:
    return (COURSE / f"{page}.md").read_text(encoding="utf-8")


def test_the_lessons_line_by_line(lessons: Path) -> None:
    """One test, because each lesson needs the runs of the one before."""
    follow("course/README.md", lessons, shorter)
    assert "teacher" in (lessons / "runs" / "class.html").read_text(encoding="utf-8")

    printed = follow("course/worksheet-1.md", lessons, shorter)
    genomes = re.findall(r"its genome\s*│\s*([0-9a-f]+)", printed)
    assert len(genomes) >= 4
    assert len(set(genomes)) < len(genomes), "seed 1 and seed 1 are the same run"

    follow("course/worksheet-2.md", lessons, shorter)
    assert "walker_step" in (lessons / "anna-walker.h").read_text(encoding="utf-8")

    follow("course/worksheet-4.md", lessons, shorter)


def test_what_is_shown_to_everybody(lessons: Path) -> None:
    (watched,) = [one.split() for one in commands_of("course/README.md") if "--watch" in one]
    with terminal([*watched[1:], *SMALL.split(), "--watch-s", "0.1"], lessons) as shown:
        assert shown.wait(120.0) == 0, shown.shown
    assert "generation 1" in shown.shown


@pytest.mark.realtime
@pytest.mark.usefixtures("unknown_robot")
def test_the_lesson_with_a_robot_line_by_line(lessons: Path) -> None:
    follow("course/worksheet-1.md", lessons, lambda words: shorter(words) if "runs/anna-1" in words[4:5] else [])
    assert "Recommended" in follow("course/worksheet-3.md", lessons, shorter, only_late)


def test_every_question_has_an_answer() -> None:
    answers = (
        _text("answers").split("## ")[2:] if _text("answers").count("## ") > 4 else _text("answers").split("## ")[1:]
    )
    for page, answer in zip(PAGES[1:], answers, strict=True):
        asked = re.findall(r"^\* ([a-g])\) ", _text(page), re.MULTILINE)
        assert asked == [letter for letter in "abcdefg" if re.search(rf"(?<![a-z]){letter}\) ", answer)], page


def test_every_picture_is_there_and_every_page_is_linked() -> None:
    for page in [*PAGES, "answers"]:
        for target in re.findall(r"\]\(([^)#:]+)\)", _text(page)):
            assert (COURSE / target).exists(), f"{page}: {target}"
    for page in [*PAGES[1:], "answers"]:
        assert f"({page}.md)" in _text("README")


def test_runs_of_worksheets_carry_a_name() -> None:
    for page in PAGES[1:]:
        named = [one for one in commands_of(f"course/{page}.md") if one.startswith("sceann evolve")]
        assert named
        assert all("--out runs/anna-" in one for one in named)

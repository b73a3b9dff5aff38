"""Every table can be read on a terminal of 80 columns: no word is cut off, no title wraps with its table."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from sceann_hil.cli import app
from tests.runs import GOAL, evolve

NAME = "goal-reach-20261127-111500-virtual-robot"
CONFIG = Path(__file__).parents[2] / "configs" / "goal_reach.yaml"
TITLES = {
    ("status",): f"{NAME}: finished",
    ("champion", "--top", "3"): f"Run {NAME}",
    ("runs",): "1 run below .",
    ("replay", "5"): "Trial 5",
    ("check",): None,
    ("plan",): f"Plan of {CONFIG}",
    ("list",): None,
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("runs")
    evolve(folder / NAME, GOAL)
    return folder


@pytest.mark.parametrize("command", TITLES, ids=lambda command: command[0])
def test_a_table_fits_and_is_whole(command: tuple[str, ...], folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    about = {"runs": ".", "plan": str(CONFIG), "list": None}.get(command[0], NAME)
    arguments = [command[0], *([about] if about else []), *command[1:]]
    done = CliRunner().invoke(app, arguments, env={"COLUMNS": "80"}, catch_exceptions=False)
    assert done.exit_code == 0
    lines = done.output.splitlines()
    boxes = [line for line in lines if line[:1] in "┏┌│┃└┡├"]
    assert boxes
    assert all(len(line) <= 80 for line in boxes)
    assert "…" not in done.output
    if (title := TITLES[command]) is not None:
        assert title in lines


def test_the_table_of_runs_shows_more_where_there_is_room(folder: Path) -> None:
    shown = [CliRunner().invoke(app, ["runs", str(folder)], env={"COLUMNS": width}).output for width in ("80", "160")]
    assert ["diffdrive" in text for text in shown] == [False, True]
    assert NAME in shown[1]

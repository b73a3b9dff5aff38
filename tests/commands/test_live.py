"""A live view that shows nothing says so: before the run if that is known, during it if not."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from sceann_hil.commands import recording
from sceann_hil.commands.recording import must_be_watchable, watched_live
from sceann_hil.errors import ViewerUnavailable
from sceann_hil.recording.feed import LiveFeed
from sceann_hil.robot import Robot
from tests.runs import GOAL, config_of, evolve
from tests.supervision.operators.fakes import Beside
from tests.supervision.operators.stations import until


@pytest.fixture
def stepped() -> Robot:
    return Beside(config_of(GOAL).robot.build())


def test_a_robot_without_steps_is_refused() -> None:
    with pytest.raises(ViewerUnavailable, match="no steps to watch"):
        must_be_watchable(config_of(GOAL).robot.build())


def test_a_machine_without_a_display_is_refused(stepped: Robot, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", ":0")
    must_be_watchable(stepped)
    monkeypatch.delenv("DISPLAY")
    with pytest.raises(ViewerUnavailable, match="no display"):
        must_be_watchable(stepped)


@pytest.mark.parametrize("how", ["killed", "cannot start"])
def test_a_viewer_that_ends_is_told_and_the_run_goes_on(
    how: str, stepped: Robot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    feeds: list[LiveFeed] = []

    def open_feed(directory: Path) -> LiveFeed:
        # without a journal there is nothing to show: the process says so, and ends
        where = directory if how == "killed" else tmp_path / "nothing"
        where.mkdir(exist_ok=True)
        feeds.append(LiveFeed(where, str(tmp_path / "live.rrd")))
        return feeds[-1]

    monkeypatch.setattr(recording, "LiveFeed", open_feed)
    evolve(tmp_path / "r", GOAL, "algorithm.population=2", "algorithm.generations=0")
    shown: list[str] = []
    with watched_live(stepped, tmp_path / "r", shown.append):
        if how == "killed":
            os.kill(feeds[0].pid, signal.SIGKILL)
        assert until(lambda: bool(shown), 60)
    assert shown[0].startswith("! The live view has ended, the run goes on: ")
    assert "live.log" in shown[0]

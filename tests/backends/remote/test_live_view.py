"""The live view: what it shows, and that it can disturb nothing."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader

from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.journal import JournalReader
from sceann_hil.recording.feed import LiveFeed
from sceann_hil.run.experiment import Experiment
from tests.backends.remote.trials import hil_robot, pole_run
from tests.runs import config_of, contents, evolve

SMALL = {"population": 2, "generations": 0, "max_steps": 30}


def evolve_watched(directory: Path, text: str, target: str, spoil: bool = False) -> LiveFeed:
    config = config_of(text)
    with Experiment.create(config, directory) as experiment, config.robot.build() as robot:
        feed = LiveFeed(directory, target)
        if spoil:
            os.kill(feed.pid, signal.SIGKILL)
            feed._process.wait()
        robot.observe(feed)
        experiment.evolve(robot)
        feed.close(timeout_s=60.0)
    return feed


def test_every_trial_is_shown_with_its_curves_and_drawn_when_it_is_over(board: PosixBoard, tmp_path: Path) -> None:
    feed = evolve_watched(tmp_path / "run", pole_run(hil_robot(board.port), **SMALL), str(tmp_path / "live.rrd"))
    log = (tmp_path / "run" / "recording" / "live.log").read_text()
    assert feed.dropped == 0
    assert "Traceback" not in log, log
    for row in JournalReader(tmp_path / "run").attempts(0):
        chunks = list(RrdReader(tmp_path / f"live-{row.id}.rrd").stream().to_chunks())
        paths = {chunk.entity_path for chunk in chunks}
        assert {"/signals/sensors", "/signals/motors", "/network/connections"} <= paths


@pytest.mark.parametrize("how", ["killed", "stalled"])
def test_a_viewer_that_is_killed_or_stalled_changes_nothing(board: PosixBoard, how: str, tmp_path: Path) -> None:
    text = pole_run(hil_robot(board.port), **SMALL)
    if how == "killed":
        feed = evolve_watched(tmp_path / "run", text, str(tmp_path / "live.rrd"), spoil=True)
        assert feed.dropped > 0
    else:
        config = config_of(text)
        with Experiment.create(config, tmp_path / "run") as experiment, config.robot.build() as robot:
            feed = LiveFeed(tmp_path / "run", str(tmp_path / "live.rrd"))
            os.kill(feed.pid, signal.SIGSTOP)
            robot.observe(feed)
            experiment.evolve(robot)
            feed.close(timeout_s=0.1)
    evolve(tmp_path / "plain", pole_run("{type: cartpole, n_sensors: 2}", **SMALL))
    assert contents(tmp_path / "run")["attempt"] == contents(tmp_path / "plain")["attempt"]


def test_a_full_pipe_drops_steps_at_once(tmp_path: Path) -> None:
    """Nobody reads: the loop goes on, and what was dropped is counted."""
    evolve(tmp_path / "run", pole_run("{type: cartpole, n_sensors: 2}", **SMALL))
    feed = LiveFeed(tmp_path / "run", str(tmp_path / "live.rrd"))
    os.kill(feed.pid, signal.SIGSTOP)
    feed.begin(1)
    sensors, state = np.zeros(12, np.uint16), np.zeros(6, np.float32)
    deadline = time.monotonic() + 30.0
    step = 0
    while feed.dropped == 0 and time.monotonic() < deadline:
        feed.step(step, sensors, state)
        step += 1
    assert feed.dropped == 1
    feed.close(timeout_s=0.0)

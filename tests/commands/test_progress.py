"""What is shown beside a robot while trials run: a clock, the budget, the forecast, and why it waits."""

from __future__ import annotations

import io
import time

import pytest
from rich.console import Console

from sceann_hil.commands import progress
from sceann_hil.commands.progress import Clock, show_progress, show_trials
from sceann_hil.supervision.operators import Desk, Phase, Situation, Status, View

TRIAL = Situation(0, 1, 2, 0, "Put it there.")
STATUS = Status(done=6, todo=18, left=("robot time: 0:20:00 left",), forecast="run ends in about 0:12:00")


def test_the_clock_begins_anew_with_every_trial_and_phase(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    clock = Clock()
    running = View(phase=Phase.RUNNING, situation=TRIAL, status=STATUS)
    assert clock.line(running).startswith("trial 7 of 18 · running 0:00 · robot time: 0:20:00 left")
    now[0] += 65.0
    assert "running 1:05" in clock.line(running)
    assert "waits for your verdict 0:00" in clock.line(View(phase=Phase.AFTER, situation=TRIAL, status=STATUS))
    now[0] += 3723.0
    assert "waits for your verdict 1:02:03" in clock.line(View(phase=Phase.AFTER, situation=TRIAL, status=STATUS))


def test_it_says_why_it_waits() -> None:
    suspended = Status(todo=3, warnings=("suspended: battery 12%",))
    assert "suspended: battery 12%" in Clock().line(View(phase=Phase.SUSPENDED, reason="battery", status=suspended))
    assert "paused (paused by web)" in Clock().line(View(phase=Phase.PAUSED, reason="paused by web"))


def test_a_log_file_gets_a_line_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "_SECONDS_BETWEEN_LINES", 0.0)
    file = io.StringIO()
    with show_trials(Console(file=file), "a robot", 3) as report:
        for done in (1, 2, 3):
            report(done, 3, 0.5)
    assert "trial 3/3 on a robot: fitness 0.5" in file.getvalue()


def test_a_log_file_beside_a_desk_says_that_the_run_is_suspended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "_SECONDS_BETWEEN_LINES", 0.02)
    file, desk = io.StringIO(), Desk(asks=False)
    with show_trials(Console(file=file), "a robot", 3, desk):
        desk.publish(Status(todo=3, warnings=("suspended: battery 12%",)))
        desk.suspend("battery", 0.3)
    assert file.getvalue().count("suspended: battery 12%; waiting until it is good again") == 1


def test_what_the_algorithm_says_of_the_next_trial_is_told_once_in_a_log_and_stays_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(progress, "_SECONDS_BETWEEN_LINES", 0.02)
    desk = Desk(asks=False)
    for terminal, times in ((False, 1), (True, 2)):
        file = io.StringIO()
        with show_progress(Console(file=file, force_terminal=terminal, width=100), 3, desk):
            desk.publish(Status(todo=1, remark="Trial 1: controller c0ffee, not tried yet."))
            deadline = time.monotonic() + 20.0
            while file.getvalue().count("controller c0ffee") < times and time.monotonic() < deadline:
                time.sleep(0.02)
        shown = file.getvalue().count("controller c0ffee")
        assert shown == 1 if not terminal else shown >= 2

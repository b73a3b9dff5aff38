"""A signal, Ctrl-Z, or a terminal that is closed: the robot stops first, then the run ends in good order, or waits."""

from __future__ import annotations

import os
import signal
import sqlite3
import time
from pathlib import Path
from typing import Any

import pytest

from sceann_hil.errors import ExitCode
from sceann_hil.journal import JOURNAL_NAME, RunLock
from tests.run.robot_on_a_pty import Rover, evolving, wait_for


def rows(directory: Path, question: str) -> list[Any]:
    db = sqlite3.connect(directory / "run" / JOURNAL_NAME)
    try:
        return db.execute(question).fetchall()
    finally:
        db.close()


@pytest.mark.parametrize("operator", ["none", "console"])
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, ExitCode.TERMINATED), (signal.SIGHUP, ExitCode.HUNG_UP)])
def test_a_signal_stops_the_robot_and_ends_the_run_in_good_order(
    number: signal.Signals, code: ExitCode, operator: str, tmp_path: Path
) -> None:
    """Regression: its last command still was to drive, and the journal never learned of the end."""
    with Rover() as rover, evolving(tmp_path, rover, operator) as terminal:
        terminal.process.send_signal(number)
        assert terminal.process.wait(20) == code, terminal.text
        assert not rover.drives
    (reason, fitness, note) = rows(tmp_path, "SELECT end_reason, fitness, note FROM attempt ORDER BY id DESC")[0]
    assert (reason, fitness, note) == ("operator", None, f"stopped by {number.name}")
    assert number.name in rows(tmp_path, "SELECT message FROM event WHERE kind = 'stopped'")[0][0]
    assert not RunLock.is_held(tmp_path / "run")


def test_closing_the_terminal_beside_the_console_operator_stops_the_robot(tmp_path: Path) -> None:
    with Rover() as rover, evolving(tmp_path, rover, "console") as terminal:
        terminal.close()
        assert terminal.process.wait(20) in (ExitCode.HUNG_UP, ExitCode.OPERATOR_FINISHED)
        assert not rover.drives
    assert rows(tmp_path, "SELECT count(*) FROM attempt WHERE end_reason IS NULL") == [(0,)]
    assert rows(tmp_path, "SELECT count(*) FROM event WHERE kind = 'stopped'") == [(1,)]


def test_the_second_ctrl_c_stops_the_robot_and_the_first_says_what_it_waits_for(tmp_path: Path) -> None:
    with Rover() as rover, evolving(tmp_path, rover) as terminal:
        terminal.type("\x03")
        wait_for(lambda: "Stopping after this generation (6 of its 6 trials are left, about" in terminal.text, terminal)
        assert rover.drives
        terminal.type("\x03")
        assert terminal.process.wait(20) == ExitCode.INTERRUPTED_NOW, terminal.text
        assert not rover.drives
    assert rows(tmp_path, "SELECT note FROM attempt") == [("stopped by Ctrl-C",)]
    assert "Stopped before the next trial, as you asked." in terminal.text


def _is_stopped(process: int) -> bool:
    return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "T"


@pytest.mark.parametrize("operator", ["none", "console"])
def test_ctrl_z_stops_the_robot_before_the_process_and_the_run_goes_on_later(operator: str, tmp_path: Path) -> None:
    with Rover() as rover, evolving(tmp_path, rover, operator) as terminal:
        process = terminal.process
        # what the shell's terminal does with the key
        process.send_signal(signal.SIGTSTP)
        wait_for(lambda: _is_stopped(process.pid), terminal)
        assert not rover.drives
        told = len(rover.commands)
        time.sleep(0.3)
        assert len(rover.commands) == told
        os.kill(process.pid, signal.SIGCONT)
        if operator == "console":
            # a person must say that the robot may move again
            wait_for(lambda: "Paused: paused by Ctrl-Z." in terminal.text, terminal)
            time.sleep(0.5)
            terminal.type("c")
            wait_for(lambda: terminal.text.count("Put the robot") == 2, terminal)
            time.sleep(0.5)
            terminal.type("r")
        wait_for(lambda: rover.drives, terminal)
        process.send_signal(signal.SIGTERM)
        assert process.wait(20) == ExitCode.TERMINATED
    notes = rows(tmp_path, "SELECT note FROM attempt ORDER BY id")
    assert notes == [("stopped by Ctrl-Z",), ("stopped by SIGTERM",)]

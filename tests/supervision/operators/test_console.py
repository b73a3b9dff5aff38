"""The console: what a key must not do."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sceann_hil.robot import EndReason
from sceann_hil.supervision.operators import Desk, Phase, Verb
from sceann_hil.supervision.operators.console import QUIET_S, Console
from sceann_hil.supervision.operators.keymap import KEYS
from sceann_hil.supervision.operators.keys import Lines
from sceann_hil.supervision.operators.terminal_keys import TerminalKeys
from tests.supervision.operators.stations import SITUATION, Run, desk_in, until


@contextmanager
def console_at(run: Run) -> Iterator[tuple[int, list[str]]]:
    """A console on a pseudo-terminal; what a person types goes into the descriptor."""
    terminal, line = pty.openpty()
    shown: list[str] = []
    with Console(run.desk, TerminalKeys(line), shown.append):
        assert until(lambda: bool(shown))
        yield terminal, shown
    os.close(line)
    os.close(terminal)


def test_every_verb_has_a_key_of_its_own() -> None:
    assert set(KEYS.values()) == set(Verb)
    assert len(set(KEYS)) == len(Verb)


def test_the_question_and_its_keys_are_shown() -> None:
    with desk_in(Phase.BEFORE) as run, console_at(run) as (_, shown):
        assert "Put it there." in shown[0]
        assert "[r] ready" in shown[0]
        assert "[a] accept" not in shown[0]


def test_an_unknown_key_asks_again_and_accepts_nothing() -> None:
    with desk_in(Phase.AFTER) as run, console_at(run) as (terminal, shown):
        time.sleep(QUIET_S)
        os.write(terminal, b"y")
        assert until(lambda: any("'y' means nothing here" in line and "[a] accept" in line for line in shown))
        assert run.ended == ""
        os.write(terminal, b"a")
        assert until(lambda: run.ended == "accept")


def test_keys_typed_ahead_are_dropped() -> None:
    desk = Desk()
    run = Run(desk)
    terminal, line = pty.openpty()
    shown: list[str] = []
    os.write(terminal, b"rararara")
    with Console(desk, TerminalKeys(line), shown.append):

        def ask() -> None:
            run.ended = desk.ask(Phase.BEFORE, SITUATION).verb.value

        thread = threading.Thread(target=ask, daemon=True)
        thread.start()
        assert until(lambda: bool(shown))
        os.write(terminal, b"r")
        time.sleep(QUIET_S + 0.1)
        assert run.ended == ""
        os.write(terminal, b"r")
        assert until(lambda: run.ended == "ready")
    os.close(line)
    os.close(terminal)


def test_stopping_is_never_too_early() -> None:
    with desk_in(Phase.RUNNING) as run, console_at(run) as (terminal, _):
        os.write(terminal, b" ")
        assert until(lambda: run.interrupts == [EndReason.OPERATOR])


def test_words_can_be_given_up() -> None:
    with desk_in(Phase.AFTER) as run, console_at(run) as (terminal, shown):
        time.sleep(QUIET_S)
        os.write(terminal, b"xoops\x1b")
        assert until(lambda: any("say why" in line for line in shown))
        assert run.ended == ""


def test_the_end_of_input_stops_what_runs_and_ends_the_run() -> None:
    with desk_in(Phase.RUNNING) as run:
        reading, writing = os.pipe()
        with Console(run.desk, Lines(reading), lambda _: None):
            os.close(writing)
            assert until(lambda: run.desk.view().finishing)
            assert run.interrupts == [EndReason.OPERATOR]
        os.close(reading)


def test_the_end_of_input_lets_nothing_count_that_was_not_judged() -> None:
    with desk_in(Phase.AFTER) as run:
        reading, writing = os.pipe()
        os.close(writing)
        with Console(run.desk, Lines(reading), lambda _: None):
            assert until(lambda: run.ended == "discard")
        os.close(reading)


ATTENDED = """
task: {type: goal_reach, max_steps: 20, headings_deg: [0]}
robot: {type: diffdrive, n_sensors: 2}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 2, generations: 1}
operator: {who: [console]}
"""


def test_without_a_terminal_the_command_ends_in_good_order(tmp_path: Path) -> None:
    (tmp_path / "run.yaml").write_text(ATTENDED)
    command = [sys.executable, "-m", "sceann_hil.cli", "evolve", "run.yaml", "--out", "r", "--record", "none"]
    repository = Path(__file__).parents[3]
    done = subprocess.run(
        command,
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(repository)},
    )
    # the whole simulated run may be over before the end of input is noticed
    assert done.returncode in (0, 41), done.stderr
    assert "Traceback" not in done.stderr

"""The console operator as a person has it: a terminal of 80 by 24, keys, and a bar that moves all the while."""

from __future__ import annotations

import os
import pty
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from sceann_hil.journal import JournalReader
from sceann_hil.supervision.operators import Desk, Phase, Prompt, Verb, console
from sceann_hil.supervision.operators.console import Console
from sceann_hil.supervision.operators.draft import Draft
from sceann_hil.supervision.operators.hits import Hit
from sceann_hil.supervision.operators.keymap import KeyMap, checked_key
from sceann_hil.supervision.operators.prompter import Prompter, ring
from sceann_hil.supervision.operators.terminal_keys import TerminalKeys
from tests.supervision.operators.stations import SITUATION, Run, desk_in, until
from tests.terminal import REPOSITORY, terminal

WATCHED = """
task: {type: goal_reach, max_steps: 200}
robot: {type: diffdrive, n_sensors: 2}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 40, generations: 100000}
operator: {who: [console]}
"""


def test_a_note_is_seen_while_it_is_typed_and_kept_whole(tmp_path: Path) -> None:
    (tmp_path / "run.yaml").write_text(WATCHED)
    arguments = ["evolve", "run.yaml", "--out", "r", "--record", "none", "--set", "operator.prompt=bell"]
    with terminal(arguments, tmp_path) as shell:
        assert shell.until("trials/s"), shell.shown
        shell.type("n")
        assert shell.until("Note (Enter ends, Esc gives up): _"), shell.shown
        for byte in "über Öx\x7fl, 日本".encode():
            shell.type(bytes([byte]))
        assert shell.until("Note (Enter ends, Esc gives up): über Öl, 日本_"), shell.shown
        before = len(shell.shown)
        shell.type("\r")
        assert shell.until("note: taken"), shell.shown
        shell.type("n" + "long " * 30)
        assert shell.until("long long long _", after=before)
        shell.type("\x1b")
        assert shell.until("note: say why", after=before)
        shell.type("f")
        assert shell.wait() == 41, shell.shown
        assert "Traceback" not in shell.shown
    with closing(JournalReader(tmp_path / "r")) as reader:
        assert any("über Öl, 日本" in str(event) for event in reader.events())


def test_a_closed_standard_input_is_its_end(tmp_path: Path) -> None:
    (tmp_path / "run.yaml").write_text(WATCHED)
    command = f"{sys.executable} -m sceann_hil.cli evolve run.yaml --out r --record none <&-"
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    done = subprocess.run(
        command, shell=True, cwd=tmp_path, capture_output=True, text=True, env=environment, timeout=120
    )
    assert done.returncode == 41, done.stderr
    assert "End of input" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.fixture(autouse=True)
def _at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(console, "QUIET_S", 0.0)


@contextmanager
def keys_of(run: Run, keymap: KeyMap | None = None) -> Iterator[tuple[int, list[str]]]:
    terminal_fd, line = pty.openpty()
    shown: list[str] = []
    with Console(run.desk, TerminalKeys(line), shown.append, keymap):
        assert until(lambda: bool(shown))
        yield terminal_fd, shown
    os.close(line)
    os.close(terminal_fd)


@pytest.mark.parametrize(
    ("typed", "words"),
    [
        ("über Öl", "über Öl"),
        ("e\u0301\x7fa", "a"),
        ("ab\x15cd", "cd"),
        ("a\x1b[Db\x1b[3~c", "abc"),
        ("x😀\x7fy", "xy"),
        ("\x7f\x7fa", "a"),
        ("tab\there", "tabhere"),
    ],
)
def test_words_are_what_was_typed(typed: str, words: str) -> None:
    with desk_in(Phase.RUNNING) as run, keys_of(run) as (terminal_fd, _):
        os.write(terminal_fd, b"n")
        assert until(lambda: run.desk.typing != "")
        for byte in typed.encode():
            os.write(terminal_fd, bytes([byte]))
        os.write(terminal_fd, b"\r")
        said: list[str] = []
        assert until(lambda: bool(said.extend(press.text for press in run.desk.said()) or said))
        assert said == [words]
        assert run.desk.typing == ""


@pytest.mark.parametrize(("sequence", "verb"), [("\x1b[19~", Verb.STOP), ("\x1b[20~", Verb.EMERGENCY_STOP)])
def test_the_stop_keys_stop_while_a_note_is_typed(sequence: str, verb: Verb) -> None:
    with desk_in(Phase.RUNNING) as run, keys_of(run) as (terminal_fd, _):
        os.write(terminal_fd, b"nit says! a ")
        assert until(lambda: run.desk.typing.endswith("it says! a "))
        os.write(terminal_fd, sequence.encode())
        assert until(lambda: len(run.interrupts) == 1)


def test_a_pedal_says_what_is_asked() -> None:
    keymap = KeyMap({"PageDown": (Verb.READY, Verb.STOP, Verb.ACCEPT), "y": (Verb.ACCEPT,)})
    for phase, verb in ((Phase.BEFORE, "ready"), (Phase.AFTER, "accept")):
        with desk_in(phase) as run, keys_of(run, keymap) as (terminal_fd, shown):
            assert "PageDown" in shown[0]
            assert until(lambda: bool(os.write(terminal_fd, b"\x1b[6~")) and run.ended == verb)  # noqa: B023
    with desk_in(Phase.RUNNING) as run, keys_of(run, keymap) as (terminal_fd, _):
        os.write(terminal_fd, b"\x1b[6~")
        assert until(lambda: len(run.interrupts) == 1)


@pytest.mark.parametrize("key", ["F8", "F9", "ab", "", "\n", "Shift"])
def test_keys_that_nobody_can_hit_are_refused(key: str) -> None:
    with pytest.raises(ValueError, match=r"F8|F9|expected"):
        checked_key(key)


@pytest.mark.parametrize("is_terminal", [True, False])
def test_a_bell_is_a_bell(
    is_terminal: bool, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)
    desk = Desk()
    with Prompter(desk, Prompt.BELL, ring):
        threading.Thread(target=desk.ask, args=(Phase.BEFORE, SITUATION), daemon=True).start()
        assert until(lambda: desk.view().question == 1)
        heard: list[str] = []
        assert until(
            lambda: bool(heard.append(capfd.readouterr().err) or "".join(heard)), 5.0 if is_terminal else 0.3
        ) is (is_terminal)
        desk.press(Verb.READY, by="test", question=1)
    assert "".join(heard) == ("\a" if is_terminal else "")


def test_help_tells_the_keys_again() -> None:
    with desk_in(Phase.AFTER) as run, keys_of(run) as (terminal_fd, shown):
        os.write(terminal_fd, b"?")
        assert until(lambda: len(shown) == 2)
        assert "[a] accept" in shown[1]


def test_somebody_who_cannot_read_can_still_press() -> None:
    def broken(_: str) -> None:
        raise BrokenPipeError

    with desk_in(Phase.RUNNING) as run:
        terminal_fd, line = pty.openpty()
        with Console(run.desk, TerminalKeys(line), broken):
            os.write(terminal_fd, b" ")
            assert until(lambda: len(run.interrupts) == 1)
        os.close(line)
        os.close(terminal_fd)


def test_a_line_is_the_words_where_there_are_only_lines() -> None:
    draft = Draft()
    draft.take(Hit("it", "slipped", "it slipped"))
    assert (draft.done, draft.text) == (True, "it slipped")

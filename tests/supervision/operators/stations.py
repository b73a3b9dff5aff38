"""A desk brought into any phase by the run's side of it, and every way of pressing a verb there."""

from __future__ import annotations

import http.client
import json
import os
import pty
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from sceann_hil.robot import EmergencyStop, EndReason
from sceann_hil.supervision.operators import Desk, Phase, Situation, Verb
from sceann_hil.supervision.operators.console import Console
from sceann_hil.supervision.operators.hits import KeySource
from sceann_hil.supervision.operators.keymap import KEYS
from sceann_hil.supervision.operators.keys import Lines
from sceann_hil.supervision.operators.script import Script, Step
from sceann_hil.supervision.operators.terminal_keys import TerminalKeys
from sceann_hil.supervision.operators.web import WebPanel
from sceann_hil.supervision.stopping import Stopped

SITUATION = Situation(3, 4, 1, 0, "Put it there.", (("x_m", 0.1),), goal_by_operator=True)
KEY_OF = {verb: key for key, verb in KEYS.items()}


@dataclass
class Run:
    """The run's side: what it was told."""

    desk: Desk
    interrupts: list[EndReason] = field(default_factory=list)
    ended: str = ""
    """How the call to the desk ended: the answer's verb, or the exception's name; empty while it waits."""
    over: threading.Event = field(default_factory=threading.Event)


def until(happened: Callable[[], bool], patience_s: float = 5.0) -> bool:
    """Wait for something that another thread does."""
    deadline = time.monotonic() + patience_s
    while not (has_happened := happened()) and time.monotonic() < deadline:
        time.sleep(0.002)
    return has_happened


@contextmanager
def desk_in(phase: Phase, *, goal_by_operator: bool = True) -> Iterator[Run]:
    """A desk in this phase, with a thread on the run's side that brought it there."""
    run = Run(Desk())
    desk = run.desk
    situation = SITUATION if goal_by_operator else Situation(0, 0, 0, 0, "")

    def work() -> None:
        try:
            if phase in (Phase.BEFORE, Phase.AFTER):
                run.ended = desk.ask(phase, situation).verb.value
            elif phase is Phase.RUNNING:
                with desk.flight(situation, run.interrupts.append):
                    run.over.wait(10)
            elif phase is Phase.PAUSED:
                desk.press(Verb.PAUSE_AFTER, by="test")
                desk.said()
                desk.between()
                run.ended = "went on"
            elif phase is Phase.SUSPENDED:
                desk.suspend("battery", 10)
                run.ended = "looked again"
        except (Stopped, EmergencyStop) as error:
            run.ended = type(error).__name__

    if phase is Phase.CLOSED:
        desk.close("test")
    thread = threading.Thread(target=work, daemon=True)
    if phase not in (Phase.IDLE, Phase.CLOSED):
        thread.start()
    assert until(lambda: desk.view().phase is phase)
    try:
        yield run
    finally:
        run.over.set()
        if thread.ident is not None and not run.ended and phase is not Phase.RUNNING:
            desk.press(Verb.EMERGENCY_STOP, by="test")
        if thread.ident is not None:
            thread.join(5)


Say = Callable[[Verb], bool]
"""Press a verb as a person would; whether it was accepted."""


@contextmanager
def at_the_desk(run: Run) -> Iterator[Say]:
    """No operator between: the table itself."""
    yield lambda verb: run.desk.press(verb, by="test", question=run.desk.view().question, text="words").accepted


@contextmanager
def with_a_script(run: Run) -> Iterator[Say]:
    operators: list[Script] = []

    def say(verb: Verb) -> bool:
        run.desk.said()
        # the last step keeps the script from running out, which would end the run
        patience = [Step(Verb.NOTE, phase, 60.0, "patience") for phase in [None] * 10]
        operators.append(Script(run.desk, [Step(verb, text="words"), *patience]))
        operators[-1].start()
        return _was_said(run, verb)

    yield say
    for operator in operators:
        operator.stop()


@contextmanager
def with_keys(run: Run) -> Iterator[Say]:
    """A terminal (pseudo) with single keys."""
    terminal, line = pty.openpty()
    with _console(run, TerminalKeys(line)):
        yield lambda verb: _type(run, terminal, verb, "\n")
    os.close(terminal)
    os.close(line)


@contextmanager
def with_lines(run: Run) -> Iterator[Say]:
    """No terminal: letters and words in lines of a pipe."""
    reading, writing = os.pipe()
    with _console(run, Lines(reading)):
        yield lambda verb: _type_line(run, writing, verb)
    os.close(writing)
    os.close(reading)


@contextmanager
def with_the_page(run: Run) -> Iterator[Say]:
    """The web panel over HTTP, as the page does it."""
    with WebPanel(run.desk, "127.0.0.1", 0) as panel:

        def say(verb: Verb) -> bool:
            question = run.desk.view().question if verb.is_answer else None
            body = {"verb": verb.value, "question": question, "text": "words"}
            return post(panel, body, cookie_of(panel))[0] == 200

        yield say


def cookie_of(panel: WebPanel) -> dict[str, str]:
    """The header of somebody who has opened the panel's link."""
    return {"Cookie": f"{panel.access.cookie}={panel.access.token}"}


def post(panel: WebPanel, body: object, headers: dict[str, str] | None = None) -> tuple[int, str]:
    """POST /press; status and text of the answer."""
    connection = http.client.HTTPConnection("127.0.0.1", panel.port, timeout=20)
    connection.request("POST", "/press", json.dumps(body), {"Content-Type": "application/json", **(headers or {})})
    answer = connection.getresponse()
    text = answer.read().decode()
    connection.close()
    return answer.status, text


@contextmanager
def _console(run: Run, keys: KeySource) -> Iterator[None]:
    shown: list[str] = []
    with Console(run.desk, keys, shown.append):
        if run.desk.view().phase in (Phase.IDLE, Phase.CLOSED):
            time.sleep(0.02)
        else:
            assert until(lambda: bool(shown))
        yield


def _type(run: Run, terminal: int, verb: Verb, end: str) -> bool:
    os.write(terminal, KEY_OF[verb].encode())
    if verb.wants_text and verb in run.desk.view().accepts:
        os.write(terminal, b"words" + end.encode())
    return _was_said(run, verb)


def _type_line(run: Run, pipe: int, verb: Verb) -> bool:
    word = "space" if verb is Verb.STOP else KEY_OF[verb]
    os.write(pipe, f"{word} {'words' if verb.wants_text else ''}\n".encode())
    return _was_said(run, verb)


def _was_said(run: Run, verb: Verb) -> bool:
    said: list[Verb] = []
    expected_soon = verb in run.desk.view().accepts

    def heard() -> bool:
        said.extend(press.verb for press in run.desk.said())
        return verb in said

    return until(heard, 5.0 if expected_soon else 0.15)

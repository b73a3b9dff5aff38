"""The table of states and verbs, exhaustively, on the desk itself and on every way of standing at it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager

import pytest

from sceann_hil.robot import EndReason
from sceann_hil.supervision.operators import ACCEPTED, Phase, Verb, console
from tests.supervision.operators.stations import (
    Run,
    Say,
    at_the_desk,
    desk_in,
    until,
    with_a_script,
    with_keys,
    with_lines,
    with_the_page,
)

EVER = {
    Verb.NOTE,
    Verb.PAUSE_AFTER,
    Verb.PAUSE_NOW,
    Verb.FINISH,
    Verb.EMERGENCY_STOP,
    Verb.BATTERY_SWAPPED,
}
TABLE = {
    Phase.IDLE: EVER,
    Phase.BEFORE: EVER | {Verb.READY, Verb.SKIP, Verb.ABORT},
    Phase.RUNNING: EVER - {Verb.BATTERY_SWAPPED} | {Verb.STOP, Verb.GOAL},
    Phase.AFTER: EVER | {Verb.ACCEPT, Verb.REDO, Verb.DISCARD},
    Phase.PAUSED: EVER - {Verb.PAUSE_AFTER, Verb.PAUSE_NOW} | {Verb.RESUME},
    Phase.SUSPENDED: EVER,
    Phase.CLOSED: set(),
}
"""Written a second time on purpose: a slip in the real table must not go unnoticed."""

WAYS = [at_the_desk, with_a_script, with_keys, with_lines, with_the_page]
Way = Callable[[Run], AbstractContextManager[Say]]


def test_the_table_is_the_specified_one() -> None:
    assert {phase: set(verbs) for phase, verbs in ACCEPTED.items()} == TABLE


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("phase", Phase)
@pytest.mark.parametrize("verb", Verb)
def test_verb_in_state(verb: Verb, phase: Phase, way: Way, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(console, "QUIET_S", 0.0)
    with desk_in(phase) as run, way(run) as say:
        before = run.desk.view()
        assert say(verb) is (verb in TABLE[phase])
        if verb not in TABLE[phase]:
            # a script that has nothing better to say ends the run; everybody else changed nothing at all
            if way is not with_a_script:
                after = run.desk.view()
                assert (after.phase, after.question, after.pausing, after.finishing) == (
                    before.phase,
                    before.question,
                    before.pausing,
                    before.finishing,
                )
                assert (run.ended, run.interrupts) == ("", [])
            return
        assert until(lambda: _happened(run, phase, verb)), (run.desk.view(), run.ended, run.interrupts)


def _happened(run: Run, phase: Phase, verb: Verb) -> bool:
    """Whether the run knows what it must know after an accepted verb."""
    view = run.desk.view()
    match phase, verb:
        case _, Verb.EMERGENCY_STOP if phase is Phase.RUNNING:
            return view.phase is Phase.CLOSED and run.interrupts == [EndReason.EMERGENCY_STOP]
        case _, Verb.EMERGENCY_STOP:
            return view.phase is Phase.CLOSED and (phase is Phase.IDLE or run.ended == "EmergencyStop")
        case _, Verb.NOTE | Verb.BATTERY_SWAPPED:
            # nothing changes but the journal's words (a suspended run looks at its battery at once)
            return run.ended == ("looked again" if phase is Phase.SUSPENDED else "")
        case Phase.BEFORE, Verb.PAUSE_AFTER | Verb.PAUSE_NOW:
            return view.phase is Phase.PAUSED and run.ended == ""
        case Phase.RUNNING, Verb.PAUSE_NOW:
            return view.pausing and run.interrupts == [EndReason.OPERATOR]
        case _, Verb.PAUSE_AFTER | Verb.PAUSE_NOW:
            return view.pausing and run.interrupts == []
        case Phase.BEFORE | Phase.PAUSED | Phase.SUSPENDED, Verb.FINISH:
            return run.ended == "Stopped"
        case _, Verb.FINISH:
            return view.finishing and run.ended == "" and run.interrupts == []
        case Phase.BEFORE, Verb.ABORT:
            return run.ended == "Stopped"
        case Phase.RUNNING, Verb.STOP:
            return run.interrupts == [EndReason.OPERATOR] and not view.pausing
        case Phase.RUNNING, Verb.GOAL:
            return run.interrupts == [EndReason.GOAL]
        case Phase.PAUSED, Verb.RESUME:
            return run.ended == "went on"
        case _:
            return run.ended == verb.value


def test_goal_is_offered_only_where_the_task_asks_for_it() -> None:
    with desk_in(Phase.RUNNING, goal_by_operator=False) as run:
        assert not run.desk.press(Verb.GOAL, by="test").accepted
        assert run.interrupts == []


@pytest.mark.parametrize("first", [Verb.STOP, Verb.GOAL, Verb.PAUSE_NOW])
@pytest.mark.parametrize("second", [Verb.STOP, Verb.GOAL, Verb.PAUSE_NOW])
def test_a_trial_is_ended_once(first: Verb, second: Verb) -> None:
    with desk_in(Phase.RUNNING) as run:
        assert run.desk.press(first, by="console").accepted
        assert not run.desk.press(second, by="web").accepted
        assert len(run.interrupts) == 1


@pytest.mark.parametrize("first", [Verb.STOP, Verb.GOAL])
def test_the_emergency_stop_comes_after_anything(first: Verb) -> None:
    with desk_in(Phase.RUNNING) as run:
        run.desk.press(first, by="web")
        assert run.desk.press(Verb.EMERGENCY_STOP, by="console").accepted
        assert run.interrupts[-1] is EndReason.EMERGENCY_STOP


@pytest.mark.parametrize("verb", [Verb.DISCARD, Verb.NOTE])
@pytest.mark.parametrize("text", ["", "   "])
def test_words_are_asked_for(verb: Verb, text: str) -> None:
    with desk_in(Phase.AFTER) as run:
        assert not run.desk.press(verb, by="test", text=text).accepted

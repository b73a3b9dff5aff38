"""Whole runs with a scripted person: what is said decides what counts, and nothing counts by accident."""

from __future__ import annotations

import sqlite3
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.robot import EmergencyStop
from sceann_hil.run.experiment import Outcome
from sceann_hil.run.trial_runner import RETRY_LIMIT
from tests.supervision.operators.fakes import Beside, attended_run

N_TRIALS = 2 * 2 * 3
"""Two generations of two individuals with three trials."""


def rows(directory: Path, question: str) -> list[Any]:
    db = sqlite3.connect(directory / JOURNAL_NAME)
    try:
        return db.execute(question).fetchall()
    finally:
        db.close()


def test_a_calm_afternoon(tmp_path: Path) -> None:
    outcome, _ = attended_run(tmp_path / "run", ["ready", "accept"], repeat=True)
    assert outcome is Outcome.FINISHED
    counted = rows(tmp_path / "run", "SELECT operator_s FROM attempt WHERE fitness IS NOT NULL")
    assert len(counted) == N_TRIALS
    assert all(operator_s is not None and operator_s >= 0 for (operator_s,) in counted)


def test_redo_comes_at_once_and_discard_after_the_others_and_both_say_why(tmp_path: Path) -> None:
    script = ["ready", "redo", "ready", "accept", "ready", "discard the wheel slipped"] + ["ready", "accept"] * N_TRIALS
    outcome, _ = attended_run(tmp_path / "run", script)
    assert outcome is Outcome.FINISHED
    first = rows(
        tmp_path / "run", "SELECT individual, trial, attempt, end_reason, note FROM attempt ORDER BY id LIMIT 4"
    )
    assert first == [
        (0, 0, 0, "operator", "redo: to be done again"),
        (0, 0, 1, first[1][3], None),
        (0, 1, 0, "operator", "discard: the wheel slipped"),
        (0, 2, 0, first[3][3], None),
    ]
    assert rows(
        tmp_path / "run", "SELECT attempt FROM attempt WHERE trial = 1 AND individual = 0 AND generation = 0"
    ) == [
        (0,),
        (1,),
    ]


def test_an_operator_may_redo_as_often_as_it_takes(tmp_path: Path) -> None:
    script = ["ready", "redo"] * (RETRY_LIMIT + 3) + ["ready", "accept"] * N_TRIALS
    assert attended_run(tmp_path / "run", script)[0] is Outcome.FINISHED


def test_skip_leaves_no_attempt_and_comes_again(tmp_path: Path) -> None:
    outcome, _ = attended_run(tmp_path / "run", ["skip"] + ["ready", "accept"] * N_TRIALS)
    assert outcome is Outcome.FINISHED
    order = rows(tmp_path / "run", "SELECT individual, trial FROM attempt WHERE generation = 0 ORDER BY id")
    assert order == [(0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 0)]


def test_abort_ends_the_run_before_the_trial_and_it_can_go_on(tmp_path: Path) -> None:
    outcome, _ = attended_run(tmp_path / "run", ["ready", "accept", "abort"])
    assert outcome is Outcome.FINISHED_BY_OPERATOR
    assert rows(tmp_path / "run", "SELECT count(*) FROM attempt") == [(1,)]
    outcome, _ = attended_run(tmp_path / "run", ["ready", "accept"], repeat=True)
    assert outcome is Outcome.FINISHED
    assert rows(tmp_path / "run", "SELECT count(*) FROM attempt WHERE fitness IS NOT NULL") == [(N_TRIALS,)]


def test_stop_voids_the_trial_that_runs(tmp_path: Path) -> None:
    endless_once = lambda body: _EndlessFirst(body)  # noqa: E731
    script = ["ready", "running: stop after 0.05 s"] + ["ready", "accept"] * N_TRIALS
    outcome, _ = attended_run(tmp_path / "run", script, robot=endless_once)
    assert outcome is Outcome.FINISHED
    assert rows(tmp_path / "run", "SELECT end_reason, fitness, note FROM attempt WHERE id = 1") == [
        ("operator", None, "stop by an operator")
    ]


def test_goal_reached_is_the_person_s_word_and_counts(tmp_path: Path) -> None:
    script = ["ready", "running: goal", "accept"] * N_TRIALS
    endless = partial(Beside, endless=True)
    outcome, _ = attended_run(tmp_path / "run", script, "task.goal_by_operator=true", robot=endless)
    assert outcome is Outcome.FINISHED
    assert rows(tmp_path / "run", "SELECT DISTINCT end_reason FROM attempt") == [("goal",)]


def test_pause_now_voids_and_waits_for_resume(tmp_path: Path) -> None:
    script = ["ready", "running: pause_now", "paused: resume after 0.05 s"] + ["ready", "accept"] * N_TRIALS
    outcome, _ = attended_run(tmp_path / "run", script, robot=lambda body: _EndlessFirst(body))
    assert outcome is Outcome.FINISHED
    assert rows(tmp_path / "run", "SELECT end_reason FROM attempt WHERE id = 1") == [("operator",)]
    assert rows(tmp_path / "run", "SELECT paused_s > 0.04 FROM session") == [(1,)]


def test_finish_after_a_trial_keeps_that_trial(tmp_path: Path) -> None:
    outcome, _ = attended_run(tmp_path / "run", ["ready", "after: finish", "accept"])
    assert outcome is Outcome.FINISHED_BY_OPERATOR
    assert rows(tmp_path / "run", "SELECT count(*) FROM attempt WHERE fitness IS NOT NULL") == [(1,)]


@pytest.mark.parametrize("script", [["ready"], ["ready", "before: ready"], []])
def test_a_script_that_runs_out_accepts_nothing(script: list[str], tmp_path: Path) -> None:
    outcome, _ = attended_run(tmp_path / "run", script)
    assert outcome is Outcome.FINISHED_BY_OPERATOR
    assert rows(tmp_path / "run", "SELECT count(*) FROM attempt WHERE fitness IS NOT NULL") == [(0,)]


@pytest.mark.parametrize(
    ("script", "attempts"),
    [
        (["before: emergency_stop"], 0),
        (["ready", "running: emergency_stop"], 1),
        (["ready", "after: emergency_stop"], 1),
    ],
)
def test_an_emergency_stop_reaches_the_robot_and_nothing_of_that_trial_counts(
    script: list[str], attempts: int, tmp_path: Path
) -> None:
    robots: list[Beside] = []

    def robot(body: Any) -> Beside:
        robots.append(_EndlessFirst(body) if "running" in script[-1] else Beside(body))
        return robots[0]

    with pytest.raises(EmergencyStop):
        attended_run(tmp_path / "run", script, robot=robot)
    assert robots[0].interrupts or robots[0].made_safe
    assert rows(tmp_path / "run", "SELECT count(*), count(fitness) FROM attempt") == [(attempts, 0)]
    assert rows(tmp_path / "run", "SELECT count(*) FROM attempt WHERE end_reason IS NULL") == [(0,)]


def test_notes_and_everything_said_are_journalled(tmp_path: Path) -> None:
    script = ["ready", "accept", "before: note the floor is wet", "battery_swapped"] + ["ready", "accept"] * N_TRIALS
    attended_run(tmp_path / "run", script)
    assert rows(tmp_path / "run", "SELECT note FROM attempt WHERE id = 1") == [("the floor is wet",)]
    said = [message for (message,) in rows(tmp_path / "run", "SELECT message FROM event WHERE kind = 'operator'")]
    assert said == ["note by script while before: the floor is wet", "battery_swapped by script while before"]


def test_reference_runs_are_asked_for_like_any_other_trial(tmp_path: Path) -> None:
    robots: list[Beside] = []

    def robot(body: Any) -> Beside:
        robots.append(Beside(body))
        return robots[0]

    script = ["ready"] * 6 + ["skip"] + ["ready"] * 30
    outcome, _ = attended_run(tmp_path / "run", script, "reference.every=4", "operator.confirm=false", robot=robot)
    assert outcome is Outcome.FINISHED
    references = rows(tmp_path / "run", "SELECT count(*) FROM attempt WHERE kind = 'reference'")[0][0]
    assert references >= 1
    assert robots[0].starts == N_TRIALS + references


def test_a_trial_that_was_never_judged_is_judged_after_a_crash_and_not_counted_by_itself(tmp_path: Path) -> None:
    class Dying(Beside):
        def run(self, trials: Any) -> Any:
            raise SystemExit("the host dies")

    class Remembering(Beside):
        def settle(self, trials: Any) -> Any:
            return self.run(trials)

    with pytest.raises(SystemExit):
        attended_run(tmp_path / "run", ["ready"], robot=Dying)
    assert rows(tmp_path / "run", "SELECT end_reason FROM attempt") == [(None,)]
    script = ["after: discard nobody saw it"] + ["ready", "accept"] * N_TRIALS
    assert attended_run(tmp_path / "run", script, robot=Remembering)[0] is Outcome.FINISHED
    assert rows(tmp_path / "run", "SELECT end_reason, note FROM attempt WHERE id = 1") == [
        ("operator", "discard: nobody saw it")
    ]


class _EndlessFirst(Beside):
    """Only the first trial waits to be interrupted."""

    def __init__(self, body: Any) -> None:
        super().__init__(body, endless=True, on_trial=self._only_once)

    def _only_once(self, number: int) -> None:
        self._endless = number == 1

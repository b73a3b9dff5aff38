"""The life of a trial: who is asked first, what is journalled when, what counts, what is done again or settled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sceann_hil.journal import AttemptKind
from sceann_hil.robot import EmergencyStop, EndReason, Results, Robot, RobotFault, Trials, TrialVoid
from sceann_hil.robot.task import Task
from sceann_hil.run.experiment import Experiment
from sceann_hil.run.trial_runner import RETRY_LIMIT, TrialRunner, TrialSet
from sceann_hil.seeds import Purpose, keys
from sceann_hil.supervision.companion import Alone, Attended, Upcoming
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside

N = 4


class Voiding(Beside):
    """Its n-th trial ends as it is told; the others are the body's."""

    def __init__(self, body: Robot, ends: dict[int, EndReason] | None = None) -> None:
        super().__init__(body)
        self.ends = ends or {}
        self.ids: list[int] = []

    def run(self, trials: Trials) -> Results:
        self.ids += trials.ids.tolist()
        results = super().run(trials)
        reason = self.ends.get(self.starts)
        return results if reason is None else replace(results, end_reasons=np.array([reason], np.uint8), why_void="why")


class Remembering(Alone):
    """Notes in which order it was asked what."""

    def __init__(self, says: Callable[[Upcoming], bool] = lambda _: True) -> None:
        self.asked: list[tuple[str, int]] = []
        self._says = says

    def clear(self, upcoming: Upcoming) -> None:
        self.asked.append(("clear", int(upcoming.slots.trial[0])))

    def ready(self, upcoming: Upcoming) -> bool:
        self.asked.append(("ready", int(upcoming.slots.trial[0])))
        return self._says(upcoming)

    def attend(self, upcoming: Upcoming, trials: Trials, run: Callable[[Trials], Results], task: Task) -> Attended:
        self.asked.append(("attend", int(upcoming.slots.trial[0])))
        return super().attend(upcoming, trials, run, task)


class Bench:
    """A runner over a real journal, and trials outside evolution for it."""

    def __init__(
        self, directory: Path, robot: type[Robot] = Voiding, companion: Alone | None = None, **more: Any
    ) -> None:
        self.config = config_of(GOAL, "task.headings_deg=[0, 45, 90, 200]")
        new = not directory.exists()
        self.experiment = Experiment.create(self.config, directory) if new else Experiment.open(directory)
        self.robot: Any = robot(self.config.robot.build(), **more)
        task = self.config.task.build()
        self.runner = TrialRunner(self.config.phenotype, task, self.robot, self.experiment.journal, companion)
        self.trials = TrialSet.outside_evolution(
            self.config.phenotype,
            np.zeros((1, self.config.genome_length), np.uint8),
            genome=np.zeros(N, np.int64),
            repeat=np.zeros(N, np.int64),
            trial=np.arange(N),
            noise=lambda places, attempts: keys(1, Purpose.REPEAT, places, attempts),
            generation=0,
            kind=AttemptKind.MEASUREMENT,
        )

    def rows(self) -> list[Any]:
        return self.experiment.journal.reader.attempts_of_kind(AttemptKind.MEASUREMENT)

    def recall(self) -> None:
        self.runner.recall(self.trials, [(row.trial, row) for row in self.rows()])

    def run(self) -> None:
        try:
            with self.robot:
                self.runner.run(self.trials, np.arange(N))
        finally:
            self.ended = [(row.trial, row.attempt, row.end_reason) for row in self.rows()]
            self.notes = [row.note for row in self.rows()]


def test_every_trial_counts_once_and_void_ones_come_again_after_the_others(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run", ends={2: EndReason.LINK_LOST})
    bench.run()
    assert [(trial, attempt) for trial, attempt, _ in bench.ended] == [(0, 0), (1, 0), (2, 0), (3, 0), (1, 1)]
    assert bench.notes == [None, "why", None, None, None]
    assert not np.isnan(bench.trials.fitness).any()
    assert bench.trials.attempts.tolist() == [1, 2, 1, 1]
    assert bench.robot.ids == [1, 2, 3, 4, 5]


def test_the_intent_is_journalled_before_the_robot_moves(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run")
    known: list[int] = []
    run = bench.robot.run
    bench.robot.run = lambda trials: (known.append(len(bench.rows())), run(trials))[1]
    bench.run()
    assert known == [1, 2, 3, 4]


def test_people_are_asked_before_and_the_trial_is_not_begun_if_they_do_not_want_it(tmp_path: Path) -> None:
    later = iter([False, True, True, True, True])
    companion = Remembering(lambda _: next(later))
    bench = Bench(tmp_path / "run", companion=companion)
    bench.run()
    assert companion.asked[:3] == [("ready", 0), ("ready", 1), ("attend", 1)]
    assert [trial for trial, *_ in bench.ended] == [1, 2, 3, 0]


def test_a_trial_that_is_always_void_pauses_the_run_after_the_limit(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run", ends=dict.fromkeys(range(1, 100), EndReason.OVERRUN))
    with pytest.raises(TrialVoid, match=f"was void {RETRY_LIMIT + 1} times"):
        bench.run()
    assert sum(trial == 0 for trial, *_ in bench.ended) == RETRY_LIMIT + 1


def test_an_operator_may_void_a_trial_as_often_as_it_takes(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run", ends=dict.fromkeys(range(1, 30), EndReason.OPERATOR))
    bench.run()
    assert len(bench.ended) == 29 + N


@pytest.mark.parametrize(
    ("reason", "error"), [(EndReason.FAULT, RobotFault), (EndReason.EMERGENCY_STOP, EmergencyStop)]
)
def test_a_fault_halts_with_the_result_in_the_journal(
    reason: EndReason, error: type[Exception], tmp_path: Path
) -> None:
    bench = Bench(tmp_path / "run", ends={2: reason})
    with pytest.raises(error):
        bench.run()
    assert [end for *_, end in bench.ended][1:] == [reason]


def test_what_counts_already_is_not_run_again_after_a_crash_and_what_was_open_is_settled_first(tmp_path: Path) -> None:
    class Dying(Voiding):
        def run(self, trials: Trials) -> Results:
            if self.starts == 2:
                raise SystemExit("the host dies")
            return super().run(trials)

    first = Bench(tmp_path / "run", Dying)
    with pytest.raises(SystemExit):
        first.run()
    first.experiment.close()
    companion = Remembering()
    again = Bench(tmp_path / "run", companion=companion)
    again.recall()
    # whoever may forbid a trial is asked before the robot is: settling may move it
    assert companion.asked == [("clear", 2), ("attend", 2)]
    again.run()
    assert [(trial, attempt) for trial, attempt, _ in again.ended] == [(0, 0), (1, 0), (2, 0), (2, 1), (3, 0)]
    assert again.ended[2][2] is EndReason.LINK_LOST
    assert "cut off" in str(again.notes[2])
    again.experiment.close()


def test_one_trial_at_a_time_is_a_plan_too(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run", companion=Remembering(lambda up: int(up.slots.trial[0]) != 3))
    assert bench.runner.run_one(bench.trials, 2)
    assert not bench.runner.run_one(bench.trials, 3)
    assert np.isnan(bench.trials.fitness).tolist() == [True, True, False, True]


def test_whoever_counts_is_told_of_every_trial_that_does(tmp_path: Path) -> None:
    told: list[int] = []
    bench = Bench(tmp_path / "run", ends={1: EndReason.LINK_LOST})
    bench.trials.on_counted = lambda places, *_: told.extend(places.tolist())
    bench.run()
    assert told == [1, 2, 3, 0]

"""Who has a say before a trial, and in which order: nobody puts a robot in place for a trial that is not run."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.journal import Slots
from sceann_hil.robot import Health
from sceann_hil.run.experiment import Experiment
from sceann_hil.supervision.budget import Amounts, Meter
from sceann_hil.supervision.companion import Upcoming
from sceann_hil.supervision.forecast import Forecast
from sceann_hil.supervision.operators import Desk, Phase, Verb
from sceann_hil.supervision.stopping import Stopped, StopReason, StopRequest
from sceann_hil.supervision.supervisor import RunFacts, Supervisor
from sceann_hil.supervision.suspenders import Low, Quantity, Suspender
from sceann_hil.supervision.suspension import Suspension
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside

ZERO = np.zeros(1, np.int64)
NEXT = Upcoming(Slots(ZERO, ZERO, ZERO), 0)


class Bench:
    """A supervisor with everybody there."""

    def __init__(self, directory: Path, limits: Amounts | None = None, stop: StopRequest = StopRequest.NONE) -> None:
        config = config_of(GOAL)
        self.experiment = Experiment.create(config, directory)
        self.robot = Beside(config.robot.build())
        self.desk = Desk()
        self.battery = Suspender(Quantity.BATTERY, Low(pause_below=0.2, resume_above=0.5, settle_s=0.0))
        task = config.task.build()
        self.meter = Meter(limits or Amounts.unlimited(), Amounts(), 12.0)
        self.supervisor = Supervisor(
            self.robot,
            self.experiment.journal,
            self.desk,
            self.meter,
            Forecast(3, 18, 12.0),
            Suspension((self.battery,), self.robot, self.desk, directory),
            RunFacts("test", task, 3),
            stop=lambda: stop,
        )

    def answer(self, *verbs: Verb) -> None:
        """A person who answers each question with the next verb."""

        def press() -> None:
            for verb in verbs:
                view = self.desk.view()
                while view.phase is not Phase.BEFORE:
                    view = self.desk.wait(view.version, 5.0)
                self.desk.press(verb, by="test", question=view.question)

        threading.Thread(target=press, daemon=True).start()


def test_a_person_is_asked_when_nothing_else_stands_in_the_way(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run")
    bench.answer(Verb.READY)
    assert bench.supervisor.ready(NEXT)
    bench.answer(Verb.SKIP)
    assert not bench.supervisor.ready(NEXT)


def test_what_the_algorithm_says_of_a_trial_is_shown_though_nobody_is_asked(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run")
    bench.supervisor.clear(Upcoming(NEXT.slots, 0, remark="It may be better."))
    assert bench.desk.view().status.remark == "It may be better."
    bench.supervisor.clear(Upcoming(NEXT.slots, 0, heading="reference", besides=True))
    assert bench.desk.view().status.remark == "It may be better."


@pytest.mark.parametrize("settling", [False, True])
def test_a_budget_that_is_spent_asks_nobody(settling: bool, tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run", Amounts(5.0, float("inf"), float("inf"), float("inf")))
    with pytest.raises(Stopped, match="only 5 s left of 5 s, and the next trial may need 12 s") as stopped:
        bench.supervisor.clear(Upcoming(NEXT.slots, 0, settling=settling))
    assert stopped.value.reason is StopReason.BUDGET
    assert bench.desk.view().question == 0


def test_a_trial_that_was_begun_is_counted_already(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run", Amounts(float("inf"), float("inf"), 0.0, float("inf")))
    bench.supervisor.clear(Upcoming(NEXT.slots, 0, settling=True))
    with pytest.raises(Stopped, match="The budget of trials is used up: 0 of 0"):
        bench.supervisor.clear(NEXT)


@pytest.mark.parametrize(
    ("request_", "reason"),
    [
        (StopRequest.NOW, StopReason.ASKED),
        (StopRequest.TERMINATED, StopReason.TERMINATED),
        (StopRequest.HUNG_UP, StopReason.HUNG_UP),
    ],
)
def test_whoever_wants_the_end_gets_it_before_anybody_is_asked(
    request_: StopRequest, reason: StopReason, tmp_path: Path
) -> None:
    bench = Bench(tmp_path / "run", stop=request_)
    with pytest.raises(Stopped) as stopped:
        bench.supervisor.ready(NEXT)
    assert stopped.value.reason is reason


def test_a_battery_that_falls_while_a_person_puts_the_robot_in_place_is_looked_at_again(tmp_path: Path) -> None:
    bench = Bench(tmp_path / "run")
    bench.robot.health_now = Health(battery_fraction=0.9)

    def low_then_good() -> None:
        view = bench.desk.view()
        while view.phase is not Phase.BEFORE:
            view = bench.desk.wait(view.version, 5.0)
        bench.robot.health_now = Health(battery_fraction=0.1)
        bench.desk.press(Verb.READY, by="test", question=view.question)
        while view.phase is not Phase.SUSPENDED:
            view = bench.desk.wait(view.version, 5.0)
        bench.robot.health_now = Health(battery_fraction=0.9)
        bench.answer(Verb.READY)

    threading.Thread(target=low_then_good, daemon=True).start()
    assert bench.supervisor.ready(NEXT)
    kinds = [kind for _, _, kind, _ in bench.experiment.journal.reader.events()]
    assert kinds == ["suspended", "unsuspended"]


def test_everybody_sees_who_leads_in_this_generation(tmp_path: Path) -> None:
    config = config_of(GOAL, "algorithm.generations=0")
    desk, seen = Desk(asks=False), list[str]()
    with Experiment.create(config, tmp_path / "run") as experiment:
        robot = Beside(config.robot.build(), on_trial=lambda _: seen.append(desk.view().status.best))
        with robot:
            experiment.evolve(robot, desk=desk, more={"trials": 6})
            # and somebody who goes on knows what was measured before
            experiment.evolve(robot, desk=(desk := Desk(asks=False)), more={"trials": 12})
        attempts = experiment.journal.reader.attempts(0)
    assert len(seen) == 18
    assert seen[0] == ""
    for done, told in enumerate(seen[1:], 1):
        rows = [row for row in attempts[:done] if row.individual * 3 + 3 <= max(done, 3)]
        if done < 3:
            continue
        means = [sum(row.fitness or 0.0 for row in rows[k : k + 3]) / 3 for k in range(0, len(rows), 3)]
        assert told == f"best so far {max(means):.4g} (individual {means.index(max(means))}, 3 trials)"

"""Suspenders: they pause and let go by themselves, say why, and void a trial only where they must."""

from __future__ import annotations

import sqlite3
import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.robot import EndReason, Health
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.supervision.suspenders import High, Low, Quantity, Suspender
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside


def test_low_pauses_below_one_threshold_and_goes_on_above_another_after_a_while() -> None:
    battery = Suspender(Quantity.BATTERY, Low(pause_below=0.2, resume_above=0.5, settle_s=10.0))
    course = [(0.3, 0, False), (0.19, 1, True), (0.4, 2, True), (0.6, 3, True), (0.6, 12.9, True), (0.6, 13, False)]
    assert [battery.look(value, now_s) for value, now_s, _ in course] == [expected for *_, expected in course]


def test_settling_begins_anew_when_the_value_is_bad_in_between() -> None:
    heat = Suspender(Quantity.TEMPERATURE, High(pause_above=60.0, resume_below=50.0, settle_s=10.0))
    course = [(61.0, 0, True), (49.0, 1, True), (51.0, 9, True), (49.0, 10, True), (49.0, 19, True), (49.0, 20, False)]
    assert [heat.look(value, now_s) for value, now_s, _ in course] == [expected for *_, expected in course]


@pytest.mark.parametrize("suspended", [False, True])
def test_without_a_value_everything_stays_as_it_is(suspended: bool) -> None:
    battery = Suspender(Quantity.BATTERY, Low(pause_below=0.2, resume_above=0.5), "battery 10%" if suspended else "")
    assert battery.look(None, 0.0) is suspended
    assert not battery.voids(None)


@pytest.mark.parametrize(
    "text", ["{battery: {pause_below: 0.5, resume_above: 0.2}}", "{temperature_c: {pause_above: 50, resume_below: 60}}"]
)
def test_thresholds_upside_down_are_refused(text: str) -> None:
    with pytest.raises(Exception, match="resume_"):
        config_of(GOAL, f"suspenders={text}")


KINDS = {
    "battery": ("{battery: {pause_below: 0.2, resume_above: 0.5, settle_s: 0}}", {"battery_fraction": 0.1}),
    "temperature": ("{temperature_c: {pause_above: 60, resume_below: 50, settle_s: 0}}", {"temperature_c": 61.0}),
    "link": ("{link_quality: {pause_below: 0.8, resume_above: 0.9, settle_s: 0}}", {"link_quality": 0.5}),
}


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_pauses_and_goes_on_by_itself_and_the_journal_says_why(kind: str, tmp_path: Path) -> None:
    suspenders, bad = KINDS[kind]
    good = {"battery_fraction": 0.9, "temperature_c": 20.0, "link_quality": 1.0}
    config = config_of(GOAL, "algorithm.generations=0", f"suspenders={suspenders}")

    class Ailing(Beside):
        def run(self, trials: Any) -> Any:
            results = super().run(trials)
            if self.starts == 2:
                self.health_now = Health(**{**good, **bad})  # type: ignore[arg-type]
                threading.Timer(0.1, self._recover).start()
            return results

        def _recover(self) -> None:
            self.health_now = Health(**good)  # type: ignore[arg-type]

    robot = Ailing(config.robot.build())
    robot.health_now = Health(**good)  # type: ignore[arg-type]
    with Experiment.create(config, tmp_path / "run") as experiment, robot:
        assert experiment.evolve(robot) is Outcome.FINISHED
    db = sqlite3.connect(tmp_path / "run" / JOURNAL_NAME)
    events = db.execute("SELECT kind, message FROM event WHERE kind LIKE '%suspended' ORDER BY id").fetchall()
    assert [name for name, _ in events] == ["suspended", "unsuspended"]
    assert kind in events[0][1]
    assert db.execute("SELECT count(*) FROM attempt WHERE fitness IS NULL").fetchone() == (0,)


def test_a_battery_that_must_void_the_trial_does(tmp_path: Path) -> None:
    text = "{battery: {pause_below: 0.2, resume_above: 0.5, settle_s: 0, void_below: 0.1}}"
    config = config_of(GOAL, "algorithm.generations=0", f"suspenders={text}")

    class Dying(Beside):
        def run(self, trials: Any) -> Any:
            self._endless = self.starts == 0
            if self._endless:
                self.health_now = Health(battery_fraction=0.05)
                threading.Timer(0.5, self._swap).start()
            return super().run(trials)

        def _swap(self) -> None:
            self.health_now = replace(self.health_now, battery_fraction=1.0)

    robot = Dying(config.robot.build())
    robot.health_now = Health(battery_fraction=1.0)
    with Experiment.create(config, tmp_path / "run") as experiment, robot:
        assert experiment.evolve(robot) is Outcome.FINISHED
    assert robot.interrupts == [EndReason.BATTERY]
    db = sqlite3.connect(tmp_path / "run" / JOURNAL_NAME)
    reason, fitness, note = db.execute("SELECT end_reason, fitness, note FROM attempt WHERE id = 1").fetchone()
    assert (reason, fitness) == ("battery", None)
    assert note.startswith("suspended: battery 5%")


def test_a_disk_that_is_nearly_full_pauses_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from collections import namedtuple

    usage = namedtuple("usage", "total used free")
    asked = iter([100.0e6] * 2 + [900.0e6] * 1000)
    monkeypatch.setattr("sceann_hil.supervision.suspension.shutil.disk_usage", lambda _: usage(0, 0, next(asked)))
    text = "{disk_free_mb: {pause_below: 500, resume_above: 600, settle_s: 0}}"
    config = config_of(GOAL, "algorithm.generations=0", f"suspenders={text}")
    with Experiment.create(config, tmp_path / "run") as experiment, Beside(config.robot.build()) as robot:
        assert experiment.evolve(robot) is Outcome.FINISHED
        assert ("suspended", "disk 100 MB free") in [
            (kind, words) for _, _, kind, words in experiment.journal.reader.events()
        ]

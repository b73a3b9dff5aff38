"""Suspenders at work: the line is probed while they wait, and a trap is refused before anything moves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from sceann_hil.config import parse_config
from sceann_hil.errors import ConfigError
from sceann_hil.journal import JournalReader
from sceann_hil.robot import EndReason, Health, Results
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.supervision import suspension
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside

LINK = "suspenders={link_quality: {pause_below: 0.8, resume_above: 0.9, settle_s: 0}}"


def test_a_line_is_probed_while_the_run_waits_for_it(tmp_path: Path) -> None:
    """Regression: the quality was that of the last trial, and none was run while suspended: it waited for ever."""

    class Noisy(Beside):
        probes = 0

        def run(self, trials: Any) -> Results:
            results = super().run(trials)
            self.health_now = Health(link_quality=0.5 if self.starts == 2 else 1.0)
            return results

        def probe(self) -> None:
            self.probes += 1
            self.health_now = Health(link_quality=0.5 if self.probes < 3 else 1.0)

    config = config_of(GOAL, "algorithm.generations=0", LINK)
    robot = Noisy(config.robot.build())
    robot.health_now = Health(link_quality=1.0)
    with Experiment.create(config, tmp_path / "run") as experiment, robot:
        assert experiment.evolve(robot) is Outcome.FINISHED
        kinds = [kind for _, _, kind, _ in experiment.journal.reader.events()]
    assert robot.probes == 3
    assert kinds.count("suspended") == kinds.count("unsuspended") == 1


@pytest.mark.parametrize(
    ("suspender", "told"),
    [
        ("battery: {pause_below: 0.2, resume_above: 0.5}", "does not measure its battery"),
        ("temperature_c: {pause_above: 60, resume_below: 50}", "does not measure its temperature"),
        ("link_quality: {pause_below: 0.2, resume_above: 0.5}", "does not measure the quality of a link"),
        ("operator_absent_s: {pause_above: 600, resume_below: 60}", "nobody's absence can be noticed"),
    ],
)
def test_a_suspender_that_would_never_see_its_value_is_refused_before_anything_moves(
    suspender: str, told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Regression: it was accepted and did nothing."""
    monkeypatch.setattr(suspension, "FIRST_VALUE_S", 0.1)
    config = config_of(GOAL, f"suspenders={{{suspender}}}")
    with Experiment.create(config, tmp_path / "run") as experiment, Beside(config.robot.build()) as robot:
        with pytest.raises(ConfigError, match=told):
            experiment.evolve(robot)
        assert robot.starts == 0
        assert experiment.forget()


@pytest.mark.parametrize(
    ("suspender", "key"),
    [
        ("battery: {pause_below: 20, resume_above: 50}", "battery.pause_below"),
        ("battery: {pause_below: 0.9, resume_above: 1.0}", "battery.resume_above"),
        ("link_quality: {pause_below: 0.0, resume_above: 0.5}", "link_quality.pause_below"),
        ("battery: {pause_below: 0.2, resume_above: 0.5, void_below: 0}", "battery.void_below"),
        ("disk_free_mb: {pause_below: 0, resume_above: 5}", "disk_free_mb.pause_below"),
        ("operator_absent_s: {pause_above: 600, resume_below: 5, settle_s: 5}", "operator_absent_s"),
    ],
)
def test_a_threshold_that_never_lets_go_or_never_holds_is_refused(suspender: str, key: str) -> None:
    with pytest.raises(ConfigError, match=f"suspenders.{key}"):
        parse_config(GOAL, "test", [f"suspenders={{{suspender}}}"])


def test_a_trial_that_was_open_is_settled_only_when_nothing_suspends_the_run(tmp_path: Path) -> None:
    """Regression: `resume` drove an open attempt before any suspender was looked at."""

    class Dying(Beside):
        def run(self, trials: Any) -> Results:
            raise SystemExit("the host dies")

    class Settling(Beside):
        settled_at: float | None = None

        def settle(self, trials: Any) -> Results:
            self.settled_at = self.health_now.battery_fraction
            return Results.void(1, EndReason.LINK_LOST, 4)

        def probe(self) -> None:
            self.health_now = Health(battery_fraction=0.9)

    config = config_of(
        GOAL, "algorithm.generations=0", "suspenders={battery: {pause_below: 0.2, resume_above: 0.5, settle_s: 0}}"
    )
    dying = Dying(config.robot.build())
    dying.health_now = Health(battery_fraction=0.9)
    with pytest.raises(SystemExit), Experiment.create(config, tmp_path / "run") as experiment, dying:
        experiment.evolve(dying)
    robot = Settling(config.robot.build())
    robot.health_now = Health(battery_fraction=0.1)
    with Experiment.open(tmp_path / "run") as experiment, robot:
        assert experiment.evolve(robot) is Outcome.FINISHED
    assert robot.settled_at == 0.9
    first = JournalReader(tmp_path / "run").attempts(0)[0]
    assert first.note == "how it ended is not known: the program was cut off while it ran"

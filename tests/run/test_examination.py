"""The doctor moves a robot under the rules that hold for trials."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from sceann_hil.robot import EndReason, Health
from sceann_hil.robot.diagnosis import Finding, Verdict
from sceann_hil.run.examination import examined
from sceann_hil.supervision import suspension
from sceann_hil.supervision.operators import Desk
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside

BATTERY = "suspenders={battery: {pause_below: 0.2, resume_above: 0.5}}"


class Patient(Beside):
    """Notes whether its motors were tried."""

    moved = False

    def diagnose(self, *, may_move: bool) -> Iterator[Finding]:
        yield Finding("handshake", Verdict.GOOD, "")
        self.moved = may_move
        yield Finding("motors", Verdict.GOOD if may_move else Verdict.NOT_DONE, "")
        yield Finding("more", Verdict.GOOD, "")


def patient(*overrides: str, battery: float | None = None) -> tuple[Patient, list[Finding]]:
    config = config_of(GOAL, *overrides)
    robot = Patient(config.robot.build())
    robot.health_now = Health(battery_fraction=battery)
    return robot, list(examined(robot, config, Desk(asks=False), may_move=True))


@pytest.mark.parametrize(("battery", "moved"), [(0.9, True), (0.1, False)])
def test_motors_are_tried_only_where_no_suspender_would_pause_a_run(battery: float, moved: bool) -> None:
    robot, findings = patient(BATTERY, battery=battery)
    assert robot.moved is moved
    assert (findings[0].check, findings[0].verdict is Verdict.GOOD) == ("suspenders", moved)


def test_a_suspender_that_would_never_see_its_value_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suspension, "FIRST_VALUE_S", 0.05)
    robot, findings = patient(BATTERY)
    assert not robot.moved
    assert "does not measure its battery" in findings[0].detail


def test_without_suspenders_everything_is_as_it_is() -> None:
    robot, findings = patient()
    assert robot.moved
    assert [finding.check for finding in findings] == ["handshake", "motors", "more"]


def test_a_signal_stops_the_robot_and_ends_the_examination() -> None:
    config = config_of(GOAL)
    robot = Patient(config.robot.build())
    desk = Desk(asks=False)
    findings = []
    for finding in examined(robot, config, desk, may_move=True):
        findings.append(finding.check)
        if finding.check == "motors":
            desk.cut_off("stopped by SIGTERM")
    assert findings == ["handshake", "motors"]
    assert robot.interrupts == [EndReason.OPERATOR]

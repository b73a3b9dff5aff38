"""The doctor moves a robot under the rules that hold for trials, through the runner of trials."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

from sceann_hil.errors import RunIsLocked
from sceann_hil.journal import AttemptKind, AttemptRow, JournalReader
from sceann_hil.robot import EndReason, Health, LinkError, Robot, TrialVoid
from sceann_hil.robot.diagnosis import Finding, Mover, Verdict
from sceann_hil.run.examination import examined
from sceann_hil.run.experiment import Experiment
from sceann_hil.run.session import Presence
from sceann_hil.run.trial_runner import RETRY_LIMIT
from sceann_hil.supervision import suspension
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.operators.script import Script, Step
from sceann_hil.supervision.stopping import StopRequest
from tests.runs import GOAL, config_of
from tests.supervision.operators.fakes import Beside

BATTERY = "suspenders={battery: {pause_below: 0.2, resume_above: 0.5}}"
SAGGING = "suspenders={battery: {pause_below: 0.2, resume_above: 0.5, void_below: 0.1}}"


class Patient(Beside):
    """Notes what was done with its motors; `movement` is done with them."""

    moved = 0

    def __init__(self, body: Robot, movement: Callable[[Patient], object]) -> None:
        super().__init__(body)
        self._movement = movement
        self.interrupted = threading.Event()

    def interrupt(self, reason: EndReason) -> None:
        super().interrupt(reason)
        self.interrupted.set()

    def diagnose(self, mover: Mover | None = None) -> Iterator[Finding]:
        yield Finding("handshake", Verdict.GOOD, "")
        if mover is None:
            yield Finding("motors", Verdict.NOT_DONE, "the robot was not moved")
        else:
            yield mover("motors", self._motors)
        yield Finding("more", Verdict.GOOD, "")

    def _motors(self) -> Finding:
        self.moved += 1
        self._movement(self)
        return Finding("motors", Verdict.GOOD, f"moved {self.moved} times")


class Visit:
    """One examination with leave to move; its findings, and what its journal knows afterwards."""

    def __init__(
        self,
        directory: Path,
        *overrides: str,
        battery: float | None = None,
        movement: Callable[[Patient], object] = lambda _: None,
        desk: Desk | None = None,
        watch: Callable[[Finding], object] = lambda _: None,
        stop: Callable[[], StopRequest] = lambda: StopRequest.NONE,
    ) -> None:
        config = config_of(GOAL, *overrides)
        self.robot = Patient(config.robot.build(), movement)
        self.robot.health_now = Health(battery_fraction=battery)
        self.findings: dict[str, Finding] = {}
        known = directory.exists()
        with Experiment.open(directory) if known else Experiment.create(config, directory) as experiment:
            presence = Presence(desk or Desk(asks=False, stop=stop), stop)
            with closing(examined(self.robot, config, presence, experiment.journal)) as found:
                for finding in found:
                    self.findings[finding.check] = finding
                    watch(finding)
        self.reader = JournalReader(directory)

    @property
    def attempts(self) -> list[AttemptRow]:
        return self.reader.attempts_of_kind(AttemptKind.MEASUREMENT)


def test_a_movement_is_in_the_journal_as_a_measurement(tmp_path: Path) -> None:
    visit = Visit(tmp_path / "doctor")
    (attempt,), (measurement,) = visit.attempts, visit.reader.measurements()
    assert (attempt.measurement, attempt.end_reason, attempt.fitness) == (measurement.id, EndReason.TIME_UP, 1.0)
    assert (measurement.kind, json.loads(measurement.plan)["movement"]) == ("doctor", "motors")
    assert measurement.finished_at is not None
    assert visit.reader.events()[-1][2:] == ("examined", "doctor, measurement 1: motors: ok: moved 1 times")
    assert list(visit.findings) == ["handshake", "motors", "more"]


def test_every_visit_moves_the_robot_anew_and_adds_to_the_journal(tmp_path: Path) -> None:
    for visits in (1, 2):
        visit = Visit(tmp_path / "doctor")
        assert visit.robot.moved == 1
        assert [row.id for row in visit.reader.measurements()] == list(range(1, visits + 1))


def test_the_intent_is_in_the_journal_before_anything_moves(tmp_path: Path) -> None:
    open_ones: list[int] = []

    def look(_: Patient) -> None:
        rows = JournalReader(tmp_path / "doctor").attempts_of_kind(AttemptKind.MEASUREMENT)
        open_ones.extend(row.id for row in rows if row.end_reason is None)

    Visit(tmp_path / "doctor", movement=look)
    assert open_ones == [1]


def test_a_run_that_somebody_works_on_is_not_disturbed(tmp_path: Path) -> None:
    with Experiment.create(config_of(GOAL), tmp_path / "run"), pytest.raises(RunIsLocked):
        Visit(tmp_path / "run")


def test_in_a_run_s_journal_the_run_s_budget_holds(tmp_path: Path) -> None:
    Visit(tmp_path / "run", "budget={trials: 1}")
    visit = Visit(tmp_path / "run", "budget={trials: 1}")
    assert visit.robot.moved == 0
    assert visit.findings["motors"].verdict is Verdict.NOT_DONE
    assert "budget" in visit.findings["motors"].detail


def test_a_person_is_asked_before_the_robot_moves(tmp_path: Path) -> None:
    desk = Desk()
    with Script(desk, [Step.parse("ready")]):
        visit = Visit(tmp_path / "doctor", desk=desk)
    assert visit.robot.moved == 1
    assert visit.attempts[0].operator_s is not None


def test_what_a_person_stopped_is_void_and_done_again(tmp_path: Path) -> None:
    desk = Desk()
    visits: list[int] = []

    def stopped_once(_: Patient) -> None:
        visits.append(1)
        if len(visits) == 1:
            desk.cut_off("stopped by somebody")

    with Script(desk, [Step.parse("ready")], repeat=True):
        visit = Visit(tmp_path / "doctor", desk=desk, movement=stopped_once)
    assert [row.end_reason for row in visit.attempts] == [EndReason.OPERATOR, EndReason.TIME_UP]
    assert visit.robot.interrupts == [EndReason.OPERATOR]
    assert visit.findings["motors"].verdict is Verdict.GOOD


def test_a_robot_that_fails_while_it_moves_is_safe_first_and_its_attempt_is_void(tmp_path: Path) -> None:
    def fail(_: Patient) -> None:
        raise LinkError("the cable came off")

    with pytest.raises(LinkError, match="the cable came off"):
        Visit(tmp_path / "doctor", movement=fail)
    reader = JournalReader(tmp_path / "doctor")
    (attempt,) = reader.attempts_of_kind(AttemptKind.MEASUREMENT)
    assert (attempt.end_reason, attempt.fitness, attempt.note) == (EndReason.FAULT, None, "the cable came off")
    assert reader.measurements()[0].finished_at is None


@pytest.mark.parametrize(("battery", "moved"), [(0.9, 1), (0.1, 0)])
def test_motors_are_tried_only_where_no_suspender_would_pause_a_run(battery: float, moved: int, tmp_path: Path) -> None:
    visit = Visit(tmp_path / "doctor", BATTERY, battery=battery)
    assert visit.robot.moved == moved
    assert (next(iter(visit.findings)), visit.findings["suspenders"].verdict is Verdict.GOOD) == (
        "suspenders",
        bool(moved),
    )


def test_a_movement_that_is_void_again_and_again_is_given_up_as_a_trial_is(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(suspension, "WATCH_S", 0.01)
    monkeypatch.setattr(suspension, "LOOK_S", 0.01)
    full = Health(battery_fraction=0.9)

    def sag(robot: Patient) -> None:
        robot.health_now = Health(battery_fraction=0.05)
        assert robot.interrupted.wait(20)
        robot.interrupted.clear()
        robot.health_now = full

    with pytest.raises(TrialVoid, match="doctor: motors was void 4 times"):
        Visit(tmp_path / "doctor", SAGGING, battery=0.9, movement=sag)
    attempts = JournalReader(tmp_path / "doctor").attempts_of_kind(AttemptKind.MEASUREMENT)
    assert [row.end_reason for row in attempts] == [EndReason.BATTERY] * (1 + RETRY_LIMIT)


def test_a_suspender_that_would_never_see_its_value_is_a_finding(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(suspension, "FIRST_VALUE_S", 0.05)
    visit = Visit(tmp_path / "doctor", BATTERY)
    assert visit.robot.moved == 0
    assert "does not measure its battery" in visit.findings["suspenders"].detail


def test_without_leave_nothing_moves() -> None:
    config = config_of(GOAL)
    robot = Patient(config.robot.build(), lambda _: None)
    findings = list(examined(robot, config, Presence(Desk(asks=False)), None))
    assert robot.moved == 0
    assert [finding.verdict for finding in findings] == [Verdict.GOOD, Verdict.NOT_DONE, Verdict.GOOD]


def test_a_signal_stops_the_robot_and_ends_the_examination(tmp_path: Path) -> None:
    desk = Desk(asks=False)

    def stop(finding: Finding) -> None:
        if finding.check == "motors":
            desk.cut_off("stopped by SIGTERM")

    visit = Visit(tmp_path / "doctor", desk=desk, watch=stop)
    assert list(visit.findings) == ["handshake", "motors"]
    assert visit.robot.interrupts == [EndReason.OPERATOR]


def test_a_signal_in_the_middle_of_a_movement_voids_it_and_nothing_moves_again(tmp_path: Path) -> None:
    desk = Desk(asks=False)
    asked: list[StopRequest] = []

    def signal(_: Patient) -> None:
        asked.append(StopRequest.TERMINATED)
        desk.cut_off("stopped by SIGTERM")

    visit = Visit(
        tmp_path / "doctor", desk=desk, movement=signal, stop=lambda: asked[-1] if asked else StopRequest.NONE
    )
    assert visit.robot.moved == 1
    assert visit.attempts[0].end_reason is EndReason.OPERATOR
    assert visit.findings["motors"].verdict is Verdict.NOT_DONE

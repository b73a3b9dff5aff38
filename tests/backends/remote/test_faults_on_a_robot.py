"""Everything that can go wrong with a robot that drives its own motors: what the motor driver gets, and the journal."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path

import can
import pytest

from backends.virtual.cable import Cable, LineFaults
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.firmware.emulated.posix import Alarm
from sceann_hil.journal import JournalReader
from sceann_hil.link.line import Incoming
from sceann_hil.link.session import RobotLink
from sceann_hil.link.vocabulary import Function
from sceann_hil.robot import EmergencyStop, EndReason, LinkError, RobotFault, TrialVoid
from sceann_hil.run.experiment import Outcome
from tests.backends.remote.phases import assert_motors_safe, counted_results, in_phase, now_us, without_motion
from tests.backends.remote.trials import pole_run, real_robot
from tests.runs import evolve, resume

TINY = {"population": 2, "generations": 0, "max_steps": 16}
PHASES = ["LOAD", "ARM", "START", "TICK", "RESULT"]
Robot = tuple[VirtualPosix, Cable]


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[object, ...]]:
    """What the same run gives in simulation."""
    directory = tmp_path_factory.mktemp("simulated") / "run"
    evolve(directory, pole_run("{type: cartpole, n_sensors: 2}", **TINY))
    return counted_results(directory)


def end_reasons(directory: Path) -> list[EndReason | None]:
    reader = JournalReader(directory)
    try:
        return [row.end_reason for row in reader.attempts(0)]
    finally:
        reader.close()


@pytest.mark.parametrize(
    ("mode", "phase"),
    [*(("onboard", phase) for phase in PHASES), *(("tethered", phase) for phase in PHASES if phase != "LOAD")],
)
def test_the_host_is_killed(
    bad_robot: Robot, phase: str, mode: str, expected: list[tuple[object, ...]], tmp_path: Path
) -> None:
    virtual, line = bad_robot
    text = pole_run(real_robot(virtual, line.port, mode), **TINY)
    pid = os.fork()
    if pid == 0:
        with pytest.MonkeyPatch.context() as patch:
            in_phase(patch, phase, lambda: os.kill(os.getpid(), signal.SIGKILL))
            try:
                evolve(tmp_path / "run", text)
            finally:
                os._exit(0)
    _, status = os.waitpid(pid, 0)
    killed_us = now_us()
    assert os.WIFSIGNALED(status)
    time.sleep(0.5)
    assert_motors_safe(virtual.driver_log, killed_us)
    assert resume(tmp_path / "run") is Outcome.FINISHED
    results = counted_results(tmp_path / "run")
    if mode == "tethered":
        assert without_motion(results) == without_motion(expected)
    else:
        assert results == expected


@pytest.mark.parametrize("phase", PHASES)
def test_the_robot_loses_power(
    bad_robot: Robot, phase: str, expected: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    virtual, line = bad_robot
    struck = in_phase(monkeypatch, phase, virtual.power_cycle)
    assert evolve(tmp_path / "run", pole_run(real_robot(virtual, line.port), **TINY)) is Outcome.FINISHED
    assert struck.is_set()
    assert counted_results(tmp_path / "run") == expected


@pytest.mark.parametrize("mode", ["onboard", "tethered"])
def test_the_cable_is_pulled_and_plugged_in_again(
    bad_robot: Robot, mode: str, expected: list[tuple[object, ...]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    virtual, line = bad_robot
    pulled_us: list[int] = []
    plugging = threading.Timer(0.6, line.plug)

    def pull() -> None:
        line.pull()
        pulled_us.append(now_us())
        plugging.start()

    in_phase(monkeypatch, "TICK", pull)
    assert evolve(tmp_path / "run", pole_run(real_robot(virtual, line.port, mode), **TINY)) is Outcome.FINISHED
    results = counted_results(tmp_path / "run")
    if mode == "tethered":
        assert without_motion(results) == without_motion(expected)
    else:
        assert results == expected
    assert_motors_safe(virtual.driver_log, pulled_us[0])
    assert EndReason.LINK_LOST in end_reasons(tmp_path / "run")


def test_the_hosts_loop_is_stuck(
    bad_robot: Robot, expected: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A host that reads nothing for a second is as good as dead: no thread may keep its heartbeat going."""
    virtual, line = bad_robot
    stuck_us: list[int] = []

    def stick() -> None:
        stuck_us.append(now_us())
        time.sleep(1.0)

    in_phase(monkeypatch, "TICK", stick)
    text = pole_run(real_robot(virtual, line.port), population=2, generations=0, max_steps=16)
    assert evolve(tmp_path / "run", text) is Outcome.FINISHED
    assert_motors_safe(virtual.driver_log, stuck_us[0])
    assert counted_results(tmp_path / "run") == expected


def test_frames_go_wrong(bad_robot: Robot, expected: object, tmp_path: Path) -> None:
    """A trial whose telemetry is not whole is void: its neurons could not be checked. Few frames go wrong here."""
    virtual, line = bad_robot
    line.faults = LineFaults(lost=0.003, doubled=0.02, spoilt=0.003, swapped=0.01)
    assert evolve(tmp_path / "run", pole_run(real_robot(virtual, line.port), **TINY)) is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == expected


def test_a_trial_whose_sensors_got_lost_is_void_and_the_run_pauses_after_four_attempts(
    bad_robot: Robot, expected: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    virtual, line = bad_robot
    note = RobotLink._note

    def forgetful(self: RobotLink, incoming: Incoming) -> None:
        if incoming.function != Function.SENSE or incoming.data[7] >> 4 != 3:
            note(self, incoming)

    monkeypatch.setattr(RobotLink, "_note", forgetful)
    with pytest.raises(TrialVoid, match="void 4 times"):
        evolve(tmp_path / "run", pole_run(real_robot(virtual, line.port), **TINY))
    assert end_reasons(tmp_path / "run") == [EndReason.LINK_LOST, EndReason.LINK_LOST] * 4
    assert counted_results(tmp_path / "run") == []
    monkeypatch.undo()
    assert resume(tmp_path / "run") is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == expected


def test_an_emergency_stop_halts_the_run_and_stays_until_somebody_resumes(
    bad_robot: Robot, expected: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    virtual, line = bad_robot
    pins = virtual.board.body
    assert pins is not None
    stopped_us: list[int] = []

    def press() -> None:
        stopped_us.append(now_us())
        pins.tell([0, 0], 8000, Alarm.ESTOP)

    in_phase(monkeypatch, "TICK", press)
    with pytest.raises(EmergencyStop):
        evolve(tmp_path / "run", pole_run(real_robot(virtual, line.port), **TINY))
    time.sleep(0.4)
    assert_motors_safe(virtual.driver_log, stopped_us[0])
    assert EndReason.EMERGENCY_STOP in end_reasons(tmp_path / "run")
    with pytest.raises(RobotFault, match="stop button is held"):
        resume(tmp_path / "run")
    pins.tell([0, 0], 8000, Alarm.NONE)
    assert resume(tmp_path / "run") is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == expected


def test_an_empty_battery_voids_the_trial_and_pauses_the_run(bad_robot: Robot, tmp_path: Path) -> None:
    virtual, line = bad_robot
    body = virtual.body
    assert body is not None
    body._driven_s = body._battery.lasts_s - 0.1
    with pytest.raises(RobotFault, match="battery 6"):
        evolve(tmp_path / "run", pole_run(real_robot(virtual, line.port), **TINY))
    assert EndReason.BATTERY in end_reasons(tmp_path / "run")
    body.change_battery()
    assert resume(tmp_path / "run") is Outcome.FINISHED


def test_a_second_host_on_the_same_can_bus_is_refused() -> None:
    """A serial port has a lock; a CAN bus has not, so the robot itself refuses."""
    with VirtualPosix(None) as other:
        first = RobotLink(can.Bus(interface="sceann_serial", channel=other.port))
        first.hello()
        second = RobotLink(first._bus, session=first.session % 65535 + 1)
        with first.exclusive(), pytest.raises(LinkError, match="another host"):
            second.hello(patience_s=0.0)
        first.close()

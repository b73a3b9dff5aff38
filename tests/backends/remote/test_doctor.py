"""What the doctor finds on robots that are well and on robots that are not."""

from __future__ import annotations

from pathlib import Path

import can
import pytest

from backends.cartpole import CartPoleConfig
from backends.remote import RemoteConfig
from backends.virtual.cable import Cable, LineFaults
from backends.virtual.can_bridge import CanBridge
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.firmware.emulated.posix import PosixBoard, RecordKind
from sceann_hil.link.session import RobotLink
from sceann_hil.plugins import RobotConfig
from sceann_hil.robot.diagnosis import Finding, Mover, Verdict
from tests.backends.remote.phases import assert_motors_safe
from tests.backends.remote.trials import virtual_config


def findings(config: RobotConfig, may_move: bool = False) -> dict[str, Finding]:
    mover: Mover | None = (lambda _, movement: movement()) if may_move else None
    return {finding.check: finding for finding in config.build().diagnose(mover)}


def test_a_robot_that_is_well(virtual: VirtualPosix) -> None:
    found = findings(virtual_config(virtual, "onboard"), may_move=True)
    assert {check for check, finding in found.items() if finding.verdict is not Verdict.GOOD} == set()
    assert set(found) == {
        "serial ports", "handshake", "round trip", "frame loss", "watchdog self-test", "sensors", "motors"
    }  # fmt: skip
    last_drive = [record for record in virtual.driver_log if record.kind is RecordKind.DRIVE][-1]
    assert_motors_safe(virtual.driver_log, last_drive.time_us)


def test_nothing_moves_without_leave(virtual: VirtualPosix) -> None:
    found = findings(virtual_config(virtual, "onboard"))
    assert found["motors"].verdict is Verdict.NOT_DONE
    assert not [record for record in virtual.driver_log if record.kind is RecordKind.DRIVE]


def test_a_board_without_a_body(board: PosixBoard) -> None:
    found = findings(RemoteConfig(port=str(board.port), mode="hil", body=CartPoleConfig()))
    assert found["sensors"].verdict is Verdict.NOT_DONE
    assert found["watchdog self-test"].verdict is Verdict.GOOD


def test_a_robot_that_is_not_there(tmp_path: Path) -> None:
    found = findings(RemoteConfig(port=str(tmp_path / "no_port"), mode="hil", body=CartPoleConfig(), reconnect_s=0.1))
    assert found["handshake"].verdict is Verdict.BAD
    assert found["handshake"].advice


def test_a_bad_cable(bad_board: tuple[PosixBoard, Cable]) -> None:
    _, line = bad_board
    line.faults = LineFaults(lost=0.02)
    found = findings(RemoteConfig(port=str(line.port), mode="hil", body=CartPoleConfig()))
    assert found["frame loss"].verdict is Verdict.BAD
    assert "repeated" in found["frame loss"].detail


def test_a_robot_that_does_not_stop_when_the_host_falls_silent(
    board: PosixBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A host that cannot fall silent looks the same from here."""
    from contextlib import nullcontext

    monkeypatch.setattr(RobotLink, "silent", lambda _: nullcontext())
    found = findings(RemoteConfig(port=str(board.port), mode="hil", body=CartPoleConfig()))
    assert found["watchdog self-test"].verdict is Verdict.BAD
    assert "Do not run" in found["watchdog self-test"].advice


def test_two_robots_with_one_number_are_no_bad_cable() -> None:
    channel = "two robots and a doctor"
    with PosixBoard(unique_id=1) as one, PosixBoard(unique_id=2) as two:
        bridges = []
        for board in (one, two):
            assert board.line is not None
            bridges.append(CanBridge(board.line.socket, can.Bus(interface="virtual", channel=channel)))
        bus = {"interface": "virtual", "channel": channel}
        found = findings(RemoteConfig(can=bus, mode="hil", body=CartPoleConfig(), reconnect_s=0.1))
        for bridge in bridges:
            bridge.close()
    assert found["handshake"].verdict is Verdict.BAD
    assert "2 robots have node 1" in found["handshake"].detail
    assert "Switch all but one of them off" in found["handshake"].advice
    assert "frame loss" not in found

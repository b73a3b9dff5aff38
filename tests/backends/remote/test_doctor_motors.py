"""The doctor's check of motors on a robot that stops before the check is over."""

from __future__ import annotations

import pytest

from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.link.session import RobotLink
from sceann_hil.link.vocabulary import Function
from sceann_hil.robot.diagnosis import Verdict
from tests.backends.remote.trials import virtual_config


def test_a_robot_that_stopped_by_itself_has_not_shown_that_silence_stops_it(
    virtual: VirtualPosix, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Regression: it was safe already when the host fell silent, and that counted as stopping at once."""
    send = RobotLink.send

    def lossy(self: RobotLink, function: Function, data: bytes = b"") -> None:
        if function is not Function.DRIVE_IN:
            send(self, function, data)

    monkeypatch.setattr(RobotLink, "send", lossy)
    found = {f.check: f for f in virtual_config(virtual, "onboard").build().diagnose(lambda _, movement: movement())}
    assert found["motors"].verdict is Verdict.BAD
    assert "overrun" in found["motors"].detail

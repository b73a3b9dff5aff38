"""A robot whose emergency stop is latched is lost and found again: it stays stopped."""

from __future__ import annotations

import time

import can
import pytest

from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.robot import EmergencyStop, EndReason
from tests.backends.remote.trials import pole_trials, virtual_config


def test_finding_the_robot_again_does_not_unlatch_its_stop(virtual: VirtualPosix) -> None:
    """Regression: the host cleared the stop together with everything else that a lost robot may be in."""
    config = virtual_config(virtual, "onboard")
    with config.build() as robot:
        robot.link._bus.shutdown()
        with config.open_bus() as somebody_else:
            somebody_else.send(can.Message(arbitration_id=0, is_extended_id=False))
            time.sleep(0.1)
        with pytest.raises(EmergencyStop):
            robot.run(pole_trials(1, 10))
    # connecting is what somebody asked for
    with config.build() as robot:
        assert not EndReason(int(robot.run(pole_trials(1, 10)).end_reasons[0])).is_void

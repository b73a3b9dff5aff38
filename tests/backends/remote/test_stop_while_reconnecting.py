"""Somebody presses stop while the host looks for its robot: the trial does not begin once the robot is found."""

from __future__ import annotations

from typing import Any

import pytest

from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.robot import EndReason
from tests.backends.remote.trials import pole_trials, virtual_config


class _Watcher:
    def __init__(self) -> None:
        self.seen: list[str] = []

    def begin(self, trial_id: int) -> None:
        self.seen.append("begin")

    def step(self, *_: Any) -> None:
        self.seen.append("step")

    def end(self) -> None:
        self.seen.append("end")


@pytest.mark.parametrize("reason", [EndReason.OPERATOR, EndReason.EMERGENCY_STOP])
def test_a_stop_while_the_line_is_opened_again_is_kept(virtual: VirtualPosix, reason: EndReason) -> None:
    with virtual_config(virtual, "onboard").build() as robot:
        watcher = _Watcher()
        robot.observe(watcher)
        connection = robot._connection
        opened = connection._open_bus

        def open_bus() -> Any:
            assert connection.link is None
            robot.interrupt(reason)
            return opened()

        connection._open_bus = open_bus
        connection.connected._bus.shutdown()
        results = robot.run(pole_trials(1, 10))
        assert EndReason(int(results.end_reasons[0])) is reason
        assert watcher.seen in ([], ["begin", "end"])
        # it was for that trial only
        assert not EndReason(int(robot.run(pole_trials(1, 10, first_id=2)).end_reasons[0])).is_void


def test_an_emergency_stop_whose_frames_are_all_lost_still_ends_the_trial(
    virtual: VirtualPosix, monkeypatch: pytest.MonkeyPatch
) -> None:
    with virtual_config(virtual, "onboard").build() as robot:
        bus = robot.link._bus
        send = bus.send

        class Presser(_Watcher):
            def step(self, *_: Any) -> None:
                super().step()
                if len(self.seen) == 3:
                    robot.interrupt(EndReason.EMERGENCY_STOP)

        monkeypatch.setattr(bus, "send", lambda message: send(message) if message.arbitration_id else None)
        robot.observe(Presser())
        results = robot.run(pole_trials(1, 500))
    assert EndReason(int(results.end_reasons[0])) is EndReason.EMERGENCY_STOP

"""A robot that takes its time to arm has not ended a trial that only then begins."""

from __future__ import annotations

import time

import pytest

from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.link import trial as link_trial
from sceann_hil.link.session import RobotLink
from tests.backends.remote.trials import counted, pole_trials, virtual_config


@pytest.mark.parametrize("mode", ["onboard", "tethered"])
def test_heartbeats_from_before_the_start_say_nothing_of_the_trial(
    virtual: VirtualPosix, mode: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Regression: two of them, and the trial was given up in its first step."""
    arm = link_trial._arm

    def patient(link: RobotLink, tick_s: float) -> None:
        until_s = time.monotonic() + 0.35
        while time.monotonic() < until_s:
            link.receive(0.02)
        arm(link, tick_s)

    monkeypatch.setattr(link_trial, "_arm", patient)
    with virtual_config(virtual, mode).build() as robot:
        counted(robot, pole_trials(1, 10), attempts=2)

"""A virtual robot whose body's computer was busy for a moment."""

from __future__ import annotations

import time

import pytest

from backends.cartpole import CartPole
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.robot import EndReason
from tests.backends.remote.trials import counted, pole_trials, virtual_config


def test_it_is_a_fault_in_that_trial_and_none_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    body = VirtualBody(CartPole(n_sensors=2))
    sense, slow = body.sense, [0.3]

    def late() -> list[int]:
        if slow:
            time.sleep(slow.pop())
        return sense()

    monkeypatch.setattr(body, "sense", late)
    with VirtualPosix(body) as virtual, virtual_config(virtual, "onboard").build() as robot:
        trials = pole_trials(2, max_steps=10)
        results = robot.run(trials.take(slice(0, 1)))
        assert EndReason(results.end_reasons[0]) is EndReason.FAULT
        time.sleep(0.4)
        assert not EndReason(counted(robot, trials.take(slice(1, 2))).end_reasons[0]).is_void

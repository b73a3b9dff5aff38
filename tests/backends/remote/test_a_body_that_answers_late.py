"""A virtual robot whose body's computer was busy for a moment."""

from __future__ import annotations

import time

import pytest

from backends.cartpole import CartPole
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.robot import EndReason
from tests.backends.remote.trials import counted, pole_trials, virtual_config


def delayed(monkeypatch: pytest.MonkeyPatch, seconds: list[float]) -> VirtualBody:
    """A cart-pole that takes so long for its first answers."""
    body = VirtualBody(CartPole())
    sense = body.sense

    def late() -> list[int]:
        if seconds:
            time.sleep(seconds.pop())
        return sense()

    monkeypatch.setattr(body, "sense", late)
    return body


def test_the_robots_time_stands_still_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    """Regression: a tenth of a second was a fault, and on a busy computer every run ended with it."""
    body = delayed(monkeypatch, [0.3, 0.3, 0.3])
    with VirtualPosix(body) as virtual, virtual_config(virtual, "onboard").build() as robot:
        results = robot.run(pole_trials(1, max_steps=10))
        assert not EndReason(results.end_reasons[0]).is_void


def test_a_body_that_is_gone_is_a_fault_in_that_trial_and_none_afterwards(monkeypatch: pytest.MonkeyPatch) -> None:
    body = delayed(monkeypatch, [3.0])
    with VirtualPosix(body) as virtual, virtual_config(virtual, "onboard").build() as robot:
        trials = pole_trials(2, max_steps=10)
        results = robot.run(trials.take(slice(0, 1)))
        assert EndReason(results.end_reasons[0]).is_void
        time.sleep(2.0)
        assert not EndReason(counted(robot, trials.take(slice(1, 2))).end_reasons[0]).is_void

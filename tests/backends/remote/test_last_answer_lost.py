"""The answer to a loop trial's last step gets lost, and the robot's word that the trial is over does not."""

from __future__ import annotations

import can
import numpy as np
import pytest

from backends.cartpole import CartPole, CartPoleConfig
from backends.remote import RemoteConfig
from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.link.vocabulary import Function
from tests.backends.remote.trials import pole_trials

STEPS = 12


def test_the_body_makes_the_last_step_too(board: PosixBoard, monkeypatch: pytest.MonkeyPatch) -> None:
    """Regression: its state after that step was journalled as zeros."""
    trial = pole_trials(1, STEPS)
    config = RemoteConfig(port=str(board.port), mode="hil", body=CartPoleConfig(n_sensors=2))
    with config.build() as robot:
        bus, drives = robot.link._bus, 0
        receive = bus.recv

        def lossy(timeout: float | None = None) -> can.Message | None:
            nonlocal drives
            message = receive(timeout)
            if message is not None and message.arbitration_id & 0x780 == Function.DRIVE:
                drives += 1
                if drives == STEPS:
                    return None
            return message

        monkeypatch.setattr(bus, "recv", lossy)
        results = robot.run(trial)
        assert drives == STEPS + 1
    simulated = CartPole().run(trial)
    assert results.steps.tolist() == simulated.steps.tolist() == [STEPS]
    np.testing.assert_array_equal(results.final_states, simulated.final_states)

"""What is pressed reaches a real robot's firmware while a trial runs: every mode, every reason."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from backends.cartpole import CartPole
from backends.remote import RemoteConfig, RemoteRobot
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import EndReason, Results, Trials
from sceann_hil.supervision.operators import Desk, Situation, Verb
from tests.supervision.operators.stations import until

SIZE = NetworkSize(2, 1, 1)
BODY = {"type": "cartpole", "n_sensors": 2}


@pytest.fixture
def virtual() -> Iterator[VirtualPosix]:
    """A cart whose pole hangs where it does not fall, so that no trial ends by itself soon."""
    with VirtualPosix(VirtualBody(CartPole())) as virtual:
        yield virtual


def robot_of(virtual: VirtualPosix, mode: str) -> RemoteRobot:
    own = {"body": BODY} if mode == "hil" else {
        "n_sensors": 2, "n_motors": 1, "tick_s": 0.02,
        "start_fields": ("x_m", "velocity_m_s", "angle_rad", "angular_velocity_rad_s"),
    }  # fmt: skip
    return RemoteConfig.model_validate({"type": "remote", "port": virtual.port, "mode": mode, **own}).build()


def trial(number: int) -> Trials:
    """A network that does nothing; upright and at rest the pole stands by itself for a while."""
    weights = Coding.SCEANN2.decode(np.zeros((1, Coding.SCEANN2.genome_length(SIZE)), np.uint8), SIZE)
    return Trials(
        size=SIZE,
        dynamics=Dynamics(),
        weights=weights,
        genome_index=np.zeros(1, np.int32),
        starts=np.zeros((1, 4)),
        keys=np.ones(1, np.uint64),
        max_steps=60_000,
        ids=np.array([number]),
    )


@pytest.mark.parametrize("mode", ["onboard", "tethered", "hil"])
def test_every_press_ends_the_trial_with_its_reason(virtual: VirtualPosix, mode: str) -> None:
    situation = Situation(0, 0, 0, 0, "", goal_by_operator=True)
    presses = [
        (Verb.STOP, EndReason.OPERATOR),
        (Verb.GOAL, EndReason.GOAL),
        (Verb.PAUSE_NOW, EndReason.OPERATOR),
        (Verb.EMERGENCY_STOP, EndReason.EMERGENCY_STOP),
    ]
    with robot_of(virtual, mode) as robot:
        for number, (verb, reason) in enumerate(presses, 1):
            if virtual.body is not None:
                virtual.body.place([0.0, 0.0, 0.0, 0.0])
            results: list[Results] = []
            desk = Desk()

            def run(number: int = number, results: list[Results] = results, desk: Desk = desk) -> None:
                with desk.flight(situation, robot.interrupt):
                    results.append(robot.run(trial(number)))

            thread = threading.Thread(target=run)
            thread.start()
            assert until(lambda desk=desk, verb=verb: verb in desk.view().accepts)  # type: ignore[misc]
            time.sleep(0.3)
            assert desk.press(verb, by="test").accepted
            thread.join(5)
            assert not thread.is_alive()
            assert EndReason(int(results[0].end_reasons[0])) is reason
            if reason is EndReason.GOAL:
                assert 0 < results[0].steps[0] < 60_000

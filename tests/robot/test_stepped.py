"""Level 2: the loop around a user's own robot."""

from __future__ import annotations

import time

import numpy as np
import pytest
from numpy.typing import NDArray

from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import EmergencyStop, EndReason, LinkError, RobotFault, RobotSpec, Trials, TrialVoid
from sceann_hil.robot.stepped import SteppedRobot

SPEC = RobotSpec("fake", 2, 1, 0.01, ("x_m",), (), batch_size=1, deterministic=False)


class Fake(SteppedRobot):
    """Does as it is told; remembers what it was told."""

    spec = SPEC

    def __init__(self, error: Exception | None = None, slow_s: float = 0.0, end: EndReason | None = None) -> None:
        super().__init__()
        self.error, self.slow_s, self.end = error, slow_s, end
        self.log: list[str] = []

    def reset(self, start: dict[str, float], key: int) -> None:
        self.log.append(f"reset {start} {key}")

    def sense(self) -> list[float]:
        time.sleep(self.slow_s)
        if self.error is not None and self.log[-1] == "drive":
            raise self.error
        return [0.25, 2.0]

    def drive(self, motors: NDArray[np.float64]) -> None:
        assert motors.shape == (1,)
        assert 0.0 <= motors[0] <= 1.0
        self.log.append("drive")

    def stop(self) -> None:
        self.log.append("stop")

    def ended(self) -> EndReason | None:
        return self.end if self.log.count("drive") == 3 else None


def one_trial(max_steps: int = 5) -> Trials:
    size = NetworkSize(2, 1, 1)
    return Trials(
        size=size,
        dynamics=Dynamics(),
        weights=np.ones((1, 2, 4), np.int8),
        genome_index=np.zeros(1, np.int32),
        starts=np.array([[0.5]]),
        keys=np.array([9], np.uint64),
        max_steps=max_steps,
        ids=np.array([1]),
    )


def test_a_trial_is_reset_then_driven_then_stopped() -> None:
    robot = Fake()
    results = robot.run(one_trial(5))
    assert robot.log == ["reset {'x_m': 0.5} 9", *["drive"] * 5, "stop"]
    assert EndReason(results.end_reasons[0]) is EndReason.TIME_UP
    assert results.traces is not None
    assert results.traces[0].sensors.tolist() == [[256, 1023]] * 5


def test_the_task_may_end_before_the_time_is_up() -> None:
    results = Fake(end=EndReason.GOAL).run(one_trial(5))
    assert (EndReason(results.end_reasons[0]), int(results.steps[0])) == (EndReason.GOAL, 3)


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (LinkError("gone"), EndReason.LINK_LOST),
        (TrialVoid("a hand in the way"), EndReason.OPERATOR),
        (RobotFault("smoke"), EndReason.FAULT),
        (EmergencyStop("pressed"), EndReason.EMERGENCY_STOP),
    ],
)
def test_a_robots_errors_make_the_attempt_void_and_the_motors_safe(error: Exception, reason: EndReason) -> None:
    robot = Fake(error=error)
    assert EndReason(robot.run(one_trial()).end_reasons[0]) is reason
    assert robot.log[-1] == "stop"


def test_any_other_error_is_a_bug_and_leaves_the_motors_safe() -> None:
    robot = Fake(error=ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        robot.run(one_trial())
    assert robot.log[-1] == "stop"


def test_three_ticks_in_a_row_that_are_a_period_late_make_the_attempt_void() -> None:
    robot = Fake(slow_s=0.03)
    assert EndReason(robot.run(one_trial(50)).end_reasons[0]) is EndReason.OVERRUN
    assert robot.log[-1] == "stop"


def test_sensors_of_another_shape_are_a_clear_error(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Fake()
    monkeypatch.setattr(robot, "sense", lambda: [0.1, 0.2, 0.3])
    with pytest.raises(ValueError, match="sense: expected 2 finite values"):
        robot.run(one_trial())


def test_make_safe_never_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = Fake()
    assert robot.make_safe("test")
    monkeypatch.setattr(robot, "stop", lambda: 1 / 0)
    assert not robot.make_safe("test")

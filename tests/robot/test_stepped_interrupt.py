"""A person ends a trial of a user's own robot: its motors stay safe from then on."""

from __future__ import annotations

import pytest

from sceann_hil.robot import EndReason
from tests.robot.test_stepped import Fake, one_trial


class Pressed(Fake):
    """Somebody presses during `reset` (step 0) or while the sensors of a step are read."""

    def __init__(self, reason: EndReason, step: int) -> None:
        super().__init__()
        self.reason, self.step = reason, step

    def _count(self) -> None:
        if self.log.count("drive") == self.step and self.reason is not None:
            self.interrupt(self.reason)
            self.step = -1

    def reset(self, start: dict[str, float], key: int) -> None:
        super().reset(start, key)
        if self.step == 0:
            self._count()

    def sense(self) -> list[float]:
        self._count()
        return super().sense()


@pytest.mark.parametrize("reason", [EndReason.OPERATOR, EndReason.EMERGENCY_STOP, EndReason.BATTERY, EndReason.GOAL])
def test_nothing_is_driven_after_a_stop(reason: EndReason) -> None:
    """Regression: the next control step drove the motors again, to the end of the trial."""
    robot = Pressed(reason, step=2)
    results = robot.run(one_trial(6))
    assert robot.log[1:] == ["drive", "drive", "stop", "stop"]
    assert (EndReason(int(results.end_reasons[0])), int(results.steps[0])) == (reason, 2)
    assert EndReason(int(robot.run(one_trial(2)).end_reasons[0])) is EndReason.TIME_UP


@pytest.mark.parametrize(
    ("pressed", "reason"), [(EndReason.BATTERY, EndReason.BATTERY), (EndReason.GOAL, EndReason.OPERATOR)]
)
def test_a_trial_that_is_called_off_before_its_first_step_is_void(pressed: EndReason, reason: EndReason) -> None:
    robot = Pressed(pressed, step=0)
    assert EndReason(int(robot.run(one_trial(6)).end_reasons[0])) is reason
    assert "drive" not in robot.log


class Confused(Pressed):
    """Its line answers the question of the sensors with what the stop was answered."""

    def sense(self) -> list[float]:
        values = super().sense()
        if self.log[-1] == "stop":
            raise ValueError("could not convert string to float: 'ok'")
        return values


def test_an_answer_that_the_stop_has_mixed_up_is_no_fault() -> None:
    results = Confused(EndReason.EMERGENCY_STOP, step=2).run(one_trial(6))
    assert EndReason(int(results.end_reasons[0])) is EndReason.EMERGENCY_STOP

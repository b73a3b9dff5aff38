"""After a crash of the host: a trial that never started is not started behind a person's back."""

from __future__ import annotations

import pytest

from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.robot import EndReason
from tests.backends.remote.trials import pole_trials, virtual_config


@pytest.mark.parametrize("attended", [True, False])
def test_an_attended_robot_does_not_move_before_somebody_is_asked(virtual: VirtualPosix, attended: bool) -> None:
    """Regression: it ran from wherever it stood, and what came of it could count."""
    with virtual_config(virtual, "onboard", attended=attended).build() as robot:
        settled = robot.settle(pole_trials(1, 10, first_id=5))
        started = robot.link.last().trial_id != 0
    assert EndReason(int(settled.end_reasons[0])).is_void is attended
    assert started is not attended

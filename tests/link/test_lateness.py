"""What a link says about itself."""

from __future__ import annotations

import numpy as np
import pytest

from sceann_hil.link.statistics import lateness_s

BEAT_S = 0.02 * np.arange(500)


@pytest.mark.parametrize("clock", [0.995, 1.0, 1.005])
def test_a_robot_with_another_idea_of_a_second_is_not_late(clock: float) -> None:
    assert lateness_s(7.0 + clock * BEAT_S).max() < 1e-9


def test_a_late_step_is_late_by_what_it_came_later_than_the_others() -> None:
    heard_s = 7.0 + BEAT_S
    heard_s[250] += 0.004
    late_s = lateness_s(heard_s)
    assert late_s[250] == pytest.approx(0.004, abs=2e-5)
    assert np.delete(late_s, 250).max() < 2e-5


def test_steps_that_were_not_heard_are_left_out() -> None:
    heard_s = 7.0 + BEAT_S
    heard_s[::3] = np.nan
    assert len(lateness_s(heard_s)) == np.count_nonzero(~np.isnan(heard_s))
    assert len(lateness_s(np.full(10, np.nan))) == 0

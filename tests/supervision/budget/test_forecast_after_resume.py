"""How many trials later generations will have: after a resume, and where races end before their last trial."""

from __future__ import annotations

import pytest

from sceann_hil.supervision.budget import Amounts
from sceann_hil.supervision.forecast import Cost, Forecast


def test_a_generation_of_which_little_is_left_says_nothing_of_the_next_ones() -> None:
    """Regression: with 1 of 5 trials left, every later generation counted as 1 trial."""
    forecast = Forecast(20, 5, 60.0, [(0, Cost(5, 50.0, 10.0)), (1, Cost(4, 40.0, 8.0))])
    forecast.begin(1, 1)
    end = forecast.ending(Amounts.unlimited())
    assert end.trials == 1 + 19 * 5
    assert end.wall_s == pytest.approx((1 + 19 * 5) * 12.0)


def test_generations_that_races_made_shorter_are_expected_to_stay_short() -> None:
    """Regression: every later generation counted as all trials that a race may have."""
    forecast = Forecast(20, 5, 60.0)
    for number in range(3):
        forecast.begin(number, 5)
        for _ in range(3):
            forecast.add([10.0], 2.0)
    forecast.begin(3, 5)
    assert forecast.ending(Amounts.unlimited()).trials == 5 + 17 * 3

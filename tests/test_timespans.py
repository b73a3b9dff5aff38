"""Durations: read as people write them, written for people, whatever the number."""

from __future__ import annotations

import pytest

from sceann_hil.timespans import MAX_DURATION_S, duration_text, parse_duration_s


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("45s", 45.0),
        ("90min", 5400.0),
        ("1h30min", 5400.0),
        ("1.5 h", 5400.0),
        ("2d", 172_800.0),
        ("36525d", MAX_DURATION_S),
    ],
)
def test_what_people_write(text: str, seconds: float) -> None:
    assert parse_duration_s(text) == seconds


@pytest.mark.parametrize("text", ["", "5", "h", "-1h", "1h-", "1 week", "1e3s", "nan", "inf"])
def test_what_is_no_duration_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected a duration such as 45s"):
        parse_duration_s(text)


@pytest.mark.parametrize("text", ["36526d", "99999999999999h", "9" * 500 + "s"])
def test_more_than_a_hundred_years_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected at most 100 years"):
        parse_duration_s(text)


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 s"),
        (12.54, "12.5 s"),
        (59.9, "59.9 s"),
        (60.0, "0:01:00"),
        (5025.0, "1:23:45"),
        (90_061.0, "1 day, 1:01:01"),
        (1e15, "more than 100 years"),
        (float("inf"), "more than 100 years"),
        (float("nan"), "unknown"),
    ],
)
def test_any_number_has_a_text(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text

"""Durations: read as people write them, written for people, whatever the number."""

from __future__ import annotations

import time

import pytest

from sceann_hil.timespans import duration_text, moment_text, parse_duration_s


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("45s", 45.0),
        ("90min", 5400.0),
        ("1h30min", 5400.0),
        ("1.5 h", 5400.0),
        ("2d", 172_800.0),
    ],
)
def test_what_people_write(text: str, seconds: float) -> None:
    assert parse_duration_s(text) == seconds


@pytest.mark.parametrize("text", ["", "5", "h", "-1h", "1h-", "1 week", "1e3s", "nan", "inf"])
def test_what_is_no_duration_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected a duration such as 45s"):
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
        (1e10, "317 years"),
        (float("inf"), "without end"),
    ],
)
def test_any_number_has_a_text(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text


def test_a_moment_is_told_on_the_clock_of_this_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TZ", "UTC-2")
    time.tzset()
    assert moment_text("2026-11-27T23:24:17.184+00:00") == "2026-11-28 01:24"
    monkeypatch.undo()
    time.tzset()
    assert moment_text("yesterday") == "yesterday"

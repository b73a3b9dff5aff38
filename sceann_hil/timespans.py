"""Durations as people write them: 45s, 90min, 2h, 1h30min."""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

_UNITS_S = {"d": 86_400.0, "h": 3600.0, "min": 60.0, "s": 1.0}
_PATTERN = r"^(?:(?:\d+(?:\.\d+)?)(?:d|h|min|s))+$"


def parse_duration_s(text: str) -> float:
    """Seconds of a duration such as ``1h30min``.

    Raises:
        ValueError: it is none.
    """
    if not re.match(_PATTERN, text.replace(" ", "")):
        raise ValueError(f"expected a duration such as 45s, 90min or 1h30min, got {text!r}")
    parts = re.findall(r"(\d+(?:\.\d+)?)(d|h|min|s)", text.replace(" ", ""))
    return sum(float(number) * _UNITS_S[unit] for number, unit in parts)


def _parsed(value: Any) -> Any:
    return parse_duration_s(value) if isinstance(value, str) else value


_CENTURY_S = 36_525 * 86_400.0

Duration = Annotated[
    float,
    Field(gt=0.0),
    BeforeValidator(_parsed),
    WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0}, {"type": "string", "pattern": _PATTERN}]}),
]
"""Seconds in a configuration: a number, or text such as 2h."""


def duration_text(seconds: float) -> str:
    """For people: ``12.5 s``, then ``1:23:45``, then ``317 years``."""
    if seconds < 60:
        return f"{seconds:.3g} s"
    if seconds < _CENTURY_S:
        return str(timedelta(seconds=round(seconds)))
    return f"{seconds / _CENTURY_S * 100:.3g} years" if seconds < float("inf") else "without end"


def moment_text(at: str) -> str:
    """A moment of a journal (ISO 8601) for people, on the clock of this computer: ``2026-11-27 11:24``."""
    try:
        return f"{datetime.fromisoformat(at).astimezone():%Y-%m-%d %H:%M}"
    except (ValueError, OverflowError):
        return at

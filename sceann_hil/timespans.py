"""Durations as people write them: 45s, 90min, 2h, 1h30min."""

from __future__ import annotations

import math
import re
from datetime import timedelta
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

_UNITS_S = {"d": 86_400.0, "h": 3600.0, "min": 60.0, "s": 1.0}
_PATTERN = r"^(?:(?:\d+(?:\.\d+)?)(?:d|h|min|s))+$"


MAX_DURATION_S = 100 * 365.25 * 86_400.0
"""A hundred years: nobody plans an experiment for longer."""


def parse_duration_s(text: str) -> float:
    """Seconds of a duration such as ``1h30min``.

    Raises:
        ValueError: it is none, or longer than a hundred years.
    """
    if not re.match(_PATTERN, text.replace(" ", "")):
        raise ValueError(f"expected a duration such as 45s, 90min or 1h30min, got {text!r}")
    parts = re.findall(r"(\d+(?:\.\d+)?)(d|h|min|s)", text.replace(" ", ""))
    seconds = sum(float(number) * _UNITS_S[unit] for number, unit in parts)
    if seconds > MAX_DURATION_S:
        raise ValueError(f"expected at most 100 years, got {text[:40]!r}")
    return seconds


def _parsed(value: Any) -> Any:
    return parse_duration_s(value) if isinstance(value, str) else value


Duration = Annotated[
    float,
    Field(gt=0.0, le=MAX_DURATION_S),
    BeforeValidator(_parsed),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": 0, "maximum": MAX_DURATION_S},
                {"type": "string", "pattern": _PATTERN},
            ]
        }
    ),
]
"""Seconds in a configuration: a number, or text such as 2h."""


def duration_text(seconds: float) -> str:
    """For people: ``12.5 s``, then ``1:23:45``, then days; any number has a text."""
    if math.isnan(seconds):
        return "unknown"
    if seconds > MAX_DURATION_S:
        return "more than 100 years"
    return f"{seconds:.3g} s" if seconds < 60 else str(timedelta(seconds=round(seconds)))

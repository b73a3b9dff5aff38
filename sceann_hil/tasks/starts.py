"""Where a robot on a plane is put: x and y in metres and a heading, one trial for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sceann_hil.plugins import Misfit, RobotConfig

START_FIELDS = ("x_m", "y_m", "heading_rad")
TURNS_DEG = (0.0, 10.0, 20.0, 30.0, 45.0, 90.0)
"""How far headings are turned to try how robust controllers are."""

Start = tuple[float, float, float]
Starts = Annotated[tuple[Start, ...], Field(min_length=1, max_length=1000)]
"""Rows of x and y in metres and a heading in degrees, counter-clockwise from the x axis."""


def as_rows(starts: Sequence[Start]) -> NDArray[np.float64]:
    """In the order of `START_FIELDS`, headings in -pi..pi, shape ``(n, 3)``."""
    rows = np.array(starts, np.float64).reshape(-1, 3)
    rows[:, 2] = (np.deg2rad(rows[:, 2]) + np.pi) % (2.0 * np.pi) - np.pi
    return rows


def instruction(start: Start) -> str:
    """What a person has to do before a trial that begins there."""
    x_m, y_m, heading_deg = start
    return (
        f"Put the robot {100 * x_m:.1f} cm from the left and {100 * y_m:.1f} cm from the lower wall, "
        f"heading {round(heading_deg) % 360}° (0° is right, 90° is up)."
    )


def turned(starts: Sequence[Start], by_deg: float) -> list[Start]:
    """The same places with other headings."""
    return [(x_m, y_m, heading_deg + by_deg) for x_m, y_m, heading_deg in starts]


def refuse_occupied(robot: RobotConfig, starts: Sequence[Start]) -> None:
    """Refuse starts at which the robot would stand in something.

    Raises:
        Misfit: the first one, and what stands there.
    """
    for number, row in enumerate(as_rows(starts).tolist()):
        refusal = robot.refuses_start(dict(zip(START_FIELDS, row, strict=True)))
        if refusal:
            raise Misfit(f"starts[{number}]: {refusal}", "task.starts")

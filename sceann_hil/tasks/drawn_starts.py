"""Starts that are drawn anew for every trial, from its own key of the seed tree.

A trial's key is journalled and so is its start: a drawn start is the same in any batch, after a resume and in replay.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import model_validator

from sceann_hil.errors import ConfigError
from sceann_hil.plugins import Misfit, RobotConfig, Section, StartVariation
from sceann_hil.seeds import Purpose, keys, uniforms
from sceann_hil.tasks.starts import START_FIELDS, TURNS_DEG, as_rows

MOST_DRAWS = 100
"""Draws of one start; where all of them are occupied, the trial is refused."""
_TRIED = 500
_LEAST_FREE = 0.2
"""Of the places tried beforehand; then a hundred draws are all occupied once in 5 * 10^9 trials."""

Range = tuple[float, float]
Draw = Callable[[NDArray[np.int64], NDArray[np.uint64]], NDArray[np.float64]]
"""Starts of trials, from their numbers and keys."""


class StartsDrawn(Section):
    """Every trial starts at a place of its own, drawn evenly from these ranges; occupied places are drawn again."""

    x_m: Range
    """From and to, metres."""
    y_m: Range
    """From and to, metres."""
    heading_deg: Range = (-180.0, 180.0)
    """From and to, degrees, counter-clockwise from the x axis."""

    @model_validator(mode="after")
    def _in_order(self) -> Self:
        for name in ("x_m", "y_m", "heading_deg"):
            low, high = getattr(self, name)
            if low > high:
                raise ValueError(f"{name}: expected the smaller value first, got [{low:g}, {high:g}]")
        return self

    def check(self, robot: RobotConfig) -> None:
        """Refuse ranges in which there is hardly a free place.

        Raises:
            Misfit: how many places of those tried are free, and what stands in the way.
        """
        refusals = _refusals(robot, self._rows(np.arange(_TRIED, dtype=np.uint64)))
        occupied = [refusal for refusal in refusals if refusal]
        if len(occupied) > (1.0 - _LEAST_FREE) * _TRIED:
            raise Misfit(
                f"starts_drawn: expected at least {_LEAST_FREE:.0%} of the places to be free, got "
                f"{1.0 - len(occupied) / _TRIED:.0%}; the first that is not: {occupied[0]}",
                "task.starts_drawn",
            )

    def turned(self) -> StartVariation | None:
        """Other headings than the drawn ones; None if all of them are drawn anyway."""
        low, high = self.heading_deg
        if high - low >= 360.0:
            return None
        changes = tuple({"starts_drawn.heading_deg": [low + turn, high + turn]} for turn in TURNS_DEG)
        return StartVariation("initial headings turned by", "degrees", TURNS_DEG, changes)

    def draw(self, robot: RobotConfig, trial: NDArray[np.int64], noise: NDArray[np.uint64]) -> NDArray[np.float64]:
        """One start for each trial, shape ``(n, 3)``, in the order of `START_FIELDS`.

        Args:
            robot: it says which places are occupied.
            trial: number of the task's trial, shape ``(n,)``.
            noise: its key from the seed tree, shape ``(n,)``.

        Raises:
            ConfigError: `MOST_DRAWS` places of a trial were occupied.
        """
        starts = np.empty((len(trial), len(START_FIELDS)))
        left = np.arange(len(trial))
        refusals: list[str] = []
        for number in range(MOST_DRAWS):
            starts[left] = self._rows(keys(noise[left], Purpose.START, trial[left], number))
            refusals = _refusals(robot, starts[left])
            left = left[[bool(refusal) for refusal in refusals]]
            if not len(left):
                return starts
        raise ConfigError(
            f"task.starts_drawn: {MOST_DRAWS} places were drawn for a trial and none is free; the last: "
            f"{next(filter(None, refusals))}.",
            "The trial was not begun. Choose ranges with more free places.",
        )

    def _rows(self, stream_keys: NDArray[np.uint64]) -> NDArray[np.float64]:
        low, high = np.array([self.x_m, self.y_m, self.heading_deg]).T
        return as_rows((low + (high - low) * uniforms(stream_keys, 3)).tolist())


def drawing(drawn: StartsDrawn | None, robot: RobotConfig) -> Draw | None:
    """How a task draws its starts for this robot; None if it does not."""
    return None if drawn is None else partial(drawn.draw, robot)


def needs_no_robot(drawn: StartsDrawn | None) -> None:
    """Refuse to build a task without its robot where only the robot can say which places are free.

    Raises:
        ValueError: starts are drawn.
    """
    if drawn is not None:
        raise ValueError("starts_drawn: expected build_for(robot), because the robot says which places are free")


def _refusals(robot: RobotConfig, rows: NDArray[np.float64]) -> list[str]:
    # the body of a robot in the loop knows its arena
    body = robot.simulated or robot
    return [body.refuses_start(dict(zip(START_FIELDS, row, strict=True))) for row in rows.tolist()]

"""Homing: goal reach without a beacon that infrared sees; the target is lit by a lamp.

Fitness as in Katada & Nakazawa, Eq. (3), from several places instead of one corner.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from sceann_hil.tasks.drawn_starts import Draw
from sceann_hil.tasks.reaching import ReachTarget
from sceann_hil.tasks.several_starts import TaskOnAPlane
from sceann_hil.tasks.starts import Starts


class HomingConfig(TaskOnAPlane):
    """Drive to a target that a lamp lights, from several places: as fast as you can."""

    type: Literal["homing"] = "homing"
    max_steps: Annotated[int, Field(ge=1, le=65_535)] = 300
    """Steps after which a trial ends."""
    starts: Starts = ((0.15, 0.15, 45.0), (0.15, 0.15, 225.0), (0.85, 0.15, 0.0), (0.15, 0.85, 270.0))
    """One trial for each: x and y in metres, heading in degrees."""
    goal_by_operator: bool = False
    """The robot cannot tell that it reached the target: the person beside it says so."""

    def task(self, draw: Draw | None) -> Homing:
        return Homing(self, draw)


class Homing(ReachTarget):
    """The target is reached from each of several starts.

    Args:
        config: its settings.
        draw: starts of trials, from their numbers and keys (see `Task.starts_of`); those of `config` if it is not
            given.
    """

    name = "homing"

    def __init__(self, config: HomingConfig = HomingConfig(), draw: Draw | None = None) -> None:  # noqa: B008
        super().__init__(config.max_steps, config.starts, config.goal_by_operator, draw)

"""Speeds of wheels, for the values of steps."""

from __future__ import annotations

from collections.abc import Callable

from sceann_hil.network.compiled import compiled_part
from sceann_hil.tasks.on_a_plane import StepTaskOnAPlane


class DrivingTask(StepTaskOnAPlane):
    """A task whose steps are worth more the faster the robot drives."""

    forwards_only: bool = False
    """The robot stands at motor value 0 and knows no backwards (`world.backwards: false`, and a board that is flashed
    as it comes); otherwise it stands at 0.5."""


def wheel_speed(forwards_only: bool) -> Callable[[float], float]:
    """From a motor value, 0..1, to the wheel's speed: -1..1, or 0..1 of a robot that knows no backwards."""
    scale, rest = (1.0, 0.0) if forwards_only else (2.0, 1.0)

    @compiled_part
    def speed(motor: float) -> float:
        return scale * motor - rest

    return speed

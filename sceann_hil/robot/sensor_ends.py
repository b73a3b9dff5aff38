"""Task ends that a robot's own sensors tell: a real robot has nobody else to ask."""

from __future__ import annotations

from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from sceann_hil.network.controller import SENSOR_MAX
from sceann_hil.plugins import Misfit, Section
from sceann_hil.robot import EndReason

TaskEnd = Literal["goal", "fell", "out_of_bounds"]


class SensorEnd(Section):
    """The trial ends when a sensor value passes a limit."""

    reason: TaskEnd
    """What it means: goal, fell or out_of_bounds."""
    sensor: Annotated[int, Field(ge=0, le=11)] | None = None
    """Which sensor, from 0; any of them if not given."""
    above: Annotated[float, Field(ge=0.0, lt=1.0)] | None = None
    """It ends when the value (0..1) is greater than this."""
    below: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    """It ends when the value (0..1) is less than this."""

    @model_validator(mode="after")
    def _has_one_limit(self) -> Self:
        if (self.above is None) == (self.below is None):
            raise Misfit("above: expected either above or below", "above", "below")
        return self

    def is_met(self, sensors: NDArray[np.uint16]) -> bool:
        """Whether these wire values, shape ``(n_sensors,)``, end the trial."""
        watched = sensors if self.sensor is None else sensors[self.sensor : self.sensor + 1]
        if self.above is not None:
            return bool((watched > self.above * SENSOR_MAX).any())
        return self.below is not None and bool((watched < self.below * SENSOR_MAX).any())


class SensorWatch:
    """The first of several ends that a tick's sensors meet."""

    def __init__(self, ends: tuple[SensorEnd, ...]) -> None:
        self._ends = ends

    def __call__(self, sensors: NDArray[np.uint16]) -> EndReason | None:
        for end in self._ends:
            if end.is_met(sensors):
                return EndReason[end.reason.upper()]
        return None

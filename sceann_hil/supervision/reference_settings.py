"""The `reference` section of a configuration."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sceann_hil.plugins import Section


class ReferenceConfig(Section):
    """A genome that is run again and again to see whether the robot drifts; off by default."""

    every: Annotated[int, Field(ge=1)] | None = None
    """Run it after so many trials, on a robot that cannot repeat a trial."""
    genome: str | None = None
    """Its bits, hexadecimal; default: the best of the first generation that is finished when the first run is due."""
    trial: Annotated[int, Field(ge=0)] = 0
    """Which of the task's starts it gets."""

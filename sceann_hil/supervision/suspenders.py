"""Reasons to pause that begin and end by themselves: battery, temperature, link, disk, nobody there.

A suspender pauses the run when its value passes a threshold, and lets it go on once the value has been beyond another
threshold for some time. They are looked at between trials; one with `void_at` is also looked at during a trial, which
it stops and voids.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Annotated, Self

from pydantic import Field, model_validator

from sceann_hil.plugins import Section
from sceann_hil.robot import EndReason


class Low(Section):
    """Pauses when a value is low."""

    pause_below: float
    """The run pauses below this value."""
    resume_above: float
    """It goes on once the value has been above this one ..."""
    settle_s: Annotated[float, Field(ge=0.0, le=86_400.0)] = 5.0
    """... for so many seconds."""
    void_below: float | None = None
    """A trial that runs is stopped and void below this value."""

    @model_validator(mode="after")
    def _right_way_up(self) -> Self:
        if self.resume_above < self.pause_below:
            raise ValueError(f"resume_above: expected at least pause_below ({self.pause_below:g})")
        if self.void_below is not None and self.void_below > self.pause_below:
            raise ValueError(f"void_below: expected at most pause_below ({self.pause_below:g})")
        return self


class High(Section):
    """Pauses when a value is high."""

    pause_above: float
    """The run pauses above this value."""
    resume_below: float
    """It goes on once the value has been below this one ..."""
    settle_s: Annotated[float, Field(ge=0.0, le=86_400.0)] = 5.0
    """... for so many seconds."""
    void_above: float | None = None
    """A trial that runs is stopped and void above this value."""

    @model_validator(mode="after")
    def _right_way_up(self) -> Self:
        if self.resume_below > self.pause_above:
            raise ValueError(f"resume_below: expected at most pause_above ({self.pause_above:g})")
        if self.void_above is not None and self.void_above < self.pause_above:
            raise ValueError(f"void_above: expected at least pause_above ({self.pause_above:g})")
        return self


class LowPart(Low):
    """Pauses when a part 0..1 is low."""

    pause_below: Annotated[float, Field(gt=0.0, le=1.0)]
    """The run pauses below this part, 0..1."""
    resume_above: Annotated[float, Field(ge=0.0, lt=1.0)]
    """It goes on once the part has been above this one (less than 1, which nothing is above) ..."""
    void_below: Annotated[float, Field(gt=0.0, le=1.0)] | None = None
    """A trial that runs is stopped and void below this part."""


class LowAmount(Low):
    """Pauses when an amount that is never negative is low."""

    pause_below: Annotated[float, Field(gt=0.0)]
    """The run pauses below this value."""


class Absence(High):
    """Pauses when nobody was there for long."""

    resume_below: Annotated[float, Field(gt=0.0)]
    """It goes on once somebody was there less than so many seconds ago, for ..."""

    @model_validator(mode="after")
    def _can_end(self) -> Self:
        # somebody who comes and stays still has been away for settle_s by the time that it would go on
        if self.resume_below <= self.settle_s:
            raise ValueError(f"resume_below: expected more than settle_s ({self.settle_s:g}), or it never goes on")
        return self


class SuspendersConfig(Section):
    """What pauses the run by itself; nothing by default."""

    battery: LowPart | None = None
    """Battery, as a fraction 0..1 of a full one."""
    temperature_c: High | None = None
    """Temperature that the robot measures, degrees Celsius."""
    link_quality: LowPart | None = None
    """Part 0..1 of the last trial's messages that came through at the first try."""
    disk_free_mb: LowAmount | None = None
    """Free space where the run is kept, megabytes."""
    operator_absent_s: Absence | None = None
    """Time since an operator did anything, or a browser was last connected, seconds."""

    def build(self) -> tuple[Suspender, ...]:
        """One suspender for each that is configured."""
        configured = ((quantity, getattr(self, quantity.value)) for quantity in Quantity)
        return tuple(Suspender(quantity, limits) for quantity, limits in configured if limits is not None)


class Quantity(Enum):
    """What a suspender looks at; the values are the configuration's keys."""

    BATTERY = "battery"
    TEMPERATURE = "temperature_c"
    LINK_QUALITY = "link_quality"
    DISK = "disk_free_mb"
    ABSENCE = "operator_absent_s"

    @property
    def void_reason(self) -> EndReason:
        """How a trial ends that it stops."""
        return EndReason.BATTERY if self is Quantity.BATTERY else EndReason.OPERATOR

    def text(self, value: float) -> str:
        """A value in words."""
        return {
            Quantity.BATTERY: f"battery {value:.0%}",
            Quantity.TEMPERATURE: f"temperature {value:.0f} °C",
            Quantity.LINK_QUALITY: f"link quality {value:.0%}",
            Quantity.DISK: f"disk {value:.0f} MB free",
            Quantity.ABSENCE: f"nobody there for {value:.0f} s",
        }[self]


@dataclass
class Suspender:
    """One of them, with its memory.

    Attributes:
        quantity: what it looks at.
        limits: its thresholds.
        reason: why it pauses the run; empty if it does not.
    """

    quantity: Quantity
    limits: Low | High
    reason: str = ""
    _good_since_s: float | None = None

    def look(self, value: float | None, now_s: float) -> bool:
        """A new value; True while the run must pause. Without a value everything stays as it is.

        Args:
            value: what is measured; None where it is not.
            now_s: monotonic.
        """
        if value is None:
            return bool(self.reason)
        limits = self.limits
        if isinstance(limits, Low):
            bad, good = value < limits.pause_below, value > limits.resume_above
        else:
            bad, good = value > limits.pause_above, value < limits.resume_below
        if not self.reason:
            if bad:
                self.reason = self.quantity.text(value)
                self._good_since_s = None
            return bad
        if not good:
            self._good_since_s = None
            return True
        if self._good_since_s is None:
            self._good_since_s = now_s
        if now_s - self._good_since_s >= limits.settle_s:
            self.reason = ""
        return bool(self.reason)

    def voids(self, value: float | None) -> bool:
        """Whether a trial that runs must be stopped."""
        limits = self.limits
        if value is None:
            return False
        if isinstance(limits, Low):
            return limits.void_below is not None and value < limits.void_below
        return limits.void_above is not None and value > limits.void_above

    @property
    def watches_trials(self) -> bool:
        """Whether it is looked at during trials."""
        return (self.limits.void_below if isinstance(self.limits, Low) else self.limits.void_above) is not None

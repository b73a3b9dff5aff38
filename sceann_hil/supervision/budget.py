"""Robot time, wall time, trials and battery: what is spent, and whether one more trial fits.

A budget is checked before a trial and never cuts one. Down-time between two sessions of a run costs nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated, Self

from pydantic import Field

from sceann_hil.plugins import Section
from sceann_hil.timespans import Duration, duration_text

_RECENT = 100
_ENOUGH = 5
"""Trials that must be measured before the measured durations are trusted."""


class BudgetConfig(Section):
    """What the run may cost; nothing is limited by default."""

    robot_time: Duration | None = None
    """Sum of the trials' durations: seconds, or text such as 2h or 90min."""
    wall_time: Duration | None = None
    """Time in which the run is being worked on, pauses included, down-time not: seconds, or text such as 3h."""
    trials: Annotated[int, Field(ge=1)] | None = None
    """Attempts of trials, void ones included."""
    battery_charges: Annotated[float, Field(gt=0.0)] | None = None
    """Full batteries, as far as the robot measures them."""
    whole_generations: bool = False
    """Do not begin a generation that does not fit as a whole."""

    @property
    def limits(self) -> Amounts:
        """The same as amounts; infinite where nothing is limited."""
        return Amounts(
            robot_s=_or_infinite(self.robot_time),
            wall_s=_or_infinite(self.wall_time),
            trials=_or_infinite(self.trials),
            battery_charges=_or_infinite(self.battery_charges),
        )


def _or_infinite(value: float | None) -> float:
    return float("inf") if value is None else float(value)


@dataclass(frozen=True, slots=True)
class Amounts:
    """Amounts of everything that a budget limits.

    Attributes:
        robot_s: robot time.
        wall_s: time in which the run is being worked on.
        trials: attempts.
        battery_charges: full batteries.
    """

    robot_s: float = 0.0
    wall_s: float = 0.0
    trials: float = 0.0
    battery_charges: float = 0.0

    def __add__(self, other: Amounts) -> Amounts:
        return Amounts(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))

    def __sub__(self, other: Amounts) -> Amounts:
        return Amounts(*(getattr(self, f.name) - getattr(other, f.name) for f in fields(self)))

    @classmethod
    def unlimited(cls) -> Self:
        """More than anybody can spend."""
        return cls(*(float("inf") for _ in fields(cls)))


_WORDS = {
    "robot_s": ("robot time", duration_text),
    "wall_s": ("wall time", duration_text),
    "trials": ("trials", lambda n: f"{n:.0f}"),
    "battery_charges": ("battery", lambda n: f"{n:.2f} charges"),
}


class Meter:
    """What a run has spent and what a trial of it costs.

    Attributes:
        spent: so far, over all sessions.

    Args:
        limits: what it may spend, over all sessions; infinite for no limit.
        spent: before this session.
        longest_trial_s: robot time of a trial that reaches its step limit.
    """

    def __init__(self, limits: Amounts, spent: Amounts, longest_trial_s: float) -> None:
        self.limits = limits
        self.spent = spent
        self._longest_trial_s = longest_trial_s
        self._robot_s: deque[float] = deque(maxlen=_RECENT)
        self._besides_s: deque[float] = deque(maxlen=_RECENT)
        self._drops: deque[float] = deque(maxlen=_RECENT)
        self._battery: float | None = None

    def add(
        self, robot_s: Sequence[float], besides_s: float, battery_fraction: float | None, *, counted: bool = False
    ) -> None:
        """Some attempts have ended, all in one call of the robot: in simulation thousands.

        Args:
            robot_s: robot time of each.
            besides_s: time that each took besides: operator, upload, bookkeeping.
            battery_fraction: what the robot measures after them.
            counted: they are counted as trials already.
        """
        n = len(robot_s)
        drop = 0.0
        if battery_fraction is not None:
            drop = max(0.0, self._battery - battery_fraction) if self._battery is not None else 0.0
            self._drops.extend((drop, *[0.0] * (min(n, _RECENT) - 1)))
            self._battery = battery_fraction
        self._robot_s.extend(robot_s[-_RECENT:])
        self._besides_s.extend([besides_s] * min(n, _RECENT))
        self.spent += Amounts(sum(robot_s), 0.0, 0.0 if counted else float(n), drop)

    def wait(self, wall_s: float) -> None:
        """Time has gone by."""
        self.spent += Amounts(wall_s=wall_s)

    @property
    def next_trial(self) -> Amounts:
        """What the next trial costs if it is like the most expensive of the recent ones.

        Before enough are measured, a trial costs what it costs at its step limit.
        """
        measured = len(self._robot_s) >= _ENOUGH
        robot_s = max(self._robot_s) if measured else self._longest_trial_s
        besides_s = sum(self._besides_s) / len(self._besides_s) if self._besides_s else 0.0
        return Amounts(robot_s, robot_s + besides_s, 1.0, max(self._drops, default=0.0))

    @property
    def mean_trial(self) -> Amounts:
        """What a trial cost on average, lately."""
        n = len(self._robot_s)
        if n < _ENOUGH:
            return Amounts(self._longest_trial_s, self._longest_trial_s, 1.0, 0.0)
        robot_s = sum(self._robot_s) / n
        drop = sum(self._drops) / len(self._drops) if self._drops else 0.0
        return Amounts(robot_s, robot_s + sum(self._besides_s) / n, 1.0, drop)

    def refusal(self, trials: int = 1, *, on_average: bool = False, counted: bool = False) -> str | None:
        """Why some more trials do not fit, in words; None if they do.

        Args:
            trials: how many.
            on_average: each costs what a trial cost on average, instead of what the most expensive ones did.
            counted: they are counted as trials already.
        """
        each = self.mean_trial if on_average else self.next_trial
        for name, (words, text) in _WORDS.items():
            limit, spent, cost = (getattr(amounts, name) for amounts in (self.limits, self.spent, each))
            if name == "trials" and counted:
                continue
            # n times 1/10 may be a little more than n/10
            if spent + trials * cost > limit * (1.0 + 1e-9):
                left = max(0.0, limit - spent)
                if left == 0.0:
                    return f"The budget of {words} is used up: {text(spent)} of {text(limit)}"
                needs = "the next trial may need" if trials == 1 else f"the next {trials} trials need about"
                return (
                    f"The budget of {words} has only {text(left)} left of {text(limit)}, and {needs} "
                    f"{text(trials * cost)}"
                )
        return None

    @property
    def remaining(self) -> Amounts:
        """What the limits still allow."""
        return self.limits - self.spent

    @property
    def left(self) -> tuple[str, ...]:
        """What is left of every limit, in words."""
        return tuple(
            f"{words}: {text(max(0.0, getattr(self.remaining, name)))} left"
            for name, (words, text) in _WORDS.items()
            if getattr(self.limits, name) != float("inf")
        )

    def trials_left(self) -> float:
        """How many average trials the limits still allow; infinite if nothing is limited."""
        each = self.mean_trial
        trials = min(
            getattr(self.remaining, f.name) / getattr(each, f.name)
            for f in fields(Amounts)
            if getattr(each, f.name) > 0.0
        )
        return float(trials)

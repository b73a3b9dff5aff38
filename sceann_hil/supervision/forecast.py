"""When the run will end: from the durations that were measured, where they are heading, and what the budget allows.

An answer costs the same however many generations there were and will be: what is past is kept as sums, and what is to
come is added up by a formula.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass

from sceann_hil.supervision.budget import Amounts
from sceann_hil.supervision.trend import LogCourse, Trend
from sceann_hil.timespans import duration_text

RECENT_GENERATIONS = 4
"""The newest generations, whose trials say what a trial takes now."""
LEAST_GENERATIONS = 4
"""Finished generations from which on a trend is looked for."""
TREND = 0.85
"""How much of the trend is believed; measured in ``tools/bench forecast``."""


@dataclass(slots=True)
class Cost:
    """What the attempts of one generation took.

    Attributes:
        attempts: how many.
        robot_s: robot time of all of them.
        besides_s: time that they took besides: operator, upload, bookkeeping.
    """

    attempts: int = 0
    robot_s: float = 0.0
    besides_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Ending:
    """The end of the run, seen from now.

    Attributes:
        by_budget: the budget is spent before the last generation is evaluated.
        trials: that will be run until then.
        wall_s: until then.
        at_limit_s: the same as `wall_s`, if from now on every trial lasts to its step limit.
    """

    by_budget: bool
    trials: float
    wall_s: float
    at_limit_s: float


class Forecast:
    """Learns from the trials of a run how long the rest will take.

    Args:
        generations: number of the last generation.
        trials_per_generation: of a whole generation.
        longest_trial_s: robot time of a trial that reaches its step limit.
        before: what generations cost in earlier sessions of the run, in order.
    """

    def __init__(
        self,
        generations: int,
        trials_per_generation: int,
        longest_trial_s: float,
        before: Iterable[tuple[int, Cost]] = (),
    ) -> None:
        self._generations = generations
        self._trials_per_generation = trials_per_generation
        self._longest_trial_s = longest_trial_s
        self._recent: deque[tuple[int, Cost]] = deque(maxlen=RECENT_GENERATIONS + 1)
        self._measured = 0
        self._trend = Trend()
        """Of all measured generations but the newest, which is not over."""
        for number, cost in before:
            if cost.attempts:
                self._append(number, cost)
        self._generation = self._recent[-1][0] if self._recent else 0
        self._todo = trials_per_generation

    def begin(self, generation: int, todo: int) -> None:
        """A generation begins, of which `todo` trials are still to be run."""
        self._generation, self._todo = generation, todo

    def add(self, robot_s: Sequence[float], besides_s: float) -> None:
        """Some attempts of this generation have ended; `besides_s` is of each."""
        n = len(robot_s)
        if not self._recent or self._recent[-1][0] != self._generation:
            self._append(self._generation, Cost())
        cost = self._recent[-1][1]
        cost.attempts += n
        cost.robot_s += sum(robot_s)
        cost.besides_s += n * besides_s
        self._todo = max(0, self._todo - n)

    def _append(self, number: int, cost: Cost) -> None:
        if self._recent:
            before, over = self._recent[-1]
            self._trend.add(math.log1p(before), over.robot_s / over.attempts)
        self._recent.append((number, cost))
        self._measured += 1

    def ending(self, left: Amounts, battery_per_trial: float = 0.0) -> Ending:
        """When the run ends.

        Args:
            left: what the budget still allows.
            battery_per_trial: fraction of a full battery that a trial takes.
        """
        by_budget, n, wall_s = self._end(self._trial_s(), left, battery_per_trial)
        at_limit_s = self._end(LogCourse.constant(self._longest_trial_s), left, battery_per_trial)[2]
        return Ending(by_budget, n, wall_s, at_limit_s)

    def _end(self, trial_s: LogCourse, left: Amounts, battery_per_trial: float) -> tuple[bool, float, float]:
        """Whether a budget ends it, trials and time until then, if a trial of each generation takes so long."""
        now, later = self._generation, max(0, self._generations - self._generation)
        each, besides_s = self._trials_of_later(), self._besides_s()
        limits = astuple(left)

        def passed(whole: int) -> tuple[float, float, float, float]:
            """Robot time, wall time, trials and battery until the end of this generation and `whole` later ones."""
            if whole < 0:
                return 0.0, 0.0, 0.0, 0.0
            trials = self._todo + whole * each
            robot_s = self._todo * trial_s.at(now) + each * trial_s.sum(now + 1, now + whole)
            return robot_s, robot_s + trials * besides_s, trials, trials * battery_per_trial

        def is_over(whole: int) -> bool:
            return any(spent > limit for spent, limit in zip(passed(whole), limits, strict=True))

        if not is_over(later):
            _, wall_s, trials, _ = passed(later)
            return False, trials, wall_s
        fits, over = -1, later
        while over - fits > 1:
            middle = (fits + over) // 2
            fits, over = (fits, middle) if is_over(middle) else (middle, over)
        before, robot_s = passed(fits), trial_s.at(now + over)
        costs = (robot_s, robot_s + besides_s, 1.0, battery_per_trial)
        room = max(0.0, min((limits[i] - before[i]) / costs[i] for i in range(len(costs)) if costs[i] > 0.0))
        return True, before[2] + room, before[1] + room * costs[1]

    def _trials_of_later(self) -> float:
        """Trials of a later generation, if it needs as many as the newest finished ones: races may need few."""
        first = max(0, self._generation - RECENT_GENERATIONS)
        sizes = {number: min(cost.attempts, self._trials_per_generation) for number, cost in self._recent}
        # a resumed generation is as large as any other, although little of it may be left
        recent = [sizes.get(number, 0) for number in range(first, self._generation)] or [
            min(sizes.get(self._generation, 0) + self._todo, self._trials_per_generation)
        ]
        return sum(recent) / len(recent)

    def _newest(self) -> list[tuple[int, Cost]]:
        return list(self._recent)[-RECENT_GENERATIONS:]

    def _besides_s(self) -> float:
        newest = [cost for _, cost in self._newest()]
        return sum(cost.besides_s for cost in newest) / max(1, sum(cost.attempts for cost in newest))

    def _trial_s(self) -> LogCourse:
        """Expected robot time of a trial by generation."""
        newest = self._newest()
        if not newest:
            return LogCourse.constant(self._longest_trial_s)
        recent_s = sum(cost.robot_s for _, cost in newest) / sum(cost.attempts for _, cost in newest)
        if self._measured <= LEAST_GENERATIONS:
            return LogCourse.constant(recent_s)
        # evolution is fast at first: durations run about straight over the logarithm of the generation
        slope = TREND * self._trend.slope
        middle = sum(math.log1p(number) for number, _ in newest) / len(newest)
        lowest_s = min(0.3 * recent_s, self._longest_trial_s)
        return LogCourse(recent_s - slope * middle, slope, lowest_s, self._longest_trial_s)

    def text(self, left: Amounts, battery_per_trial: float = 0.0) -> str:
        """For people: when the run ends, or its budget before it."""
        if not self._recent:
            return ""
        end = self.ending(left, battery_per_trial)
        told = f"{'budget' if end.by_budget else 'run'} ends in about {duration_text(end.wall_s)}"
        if abs(end.at_limit_s - end.wall_s) > 0.2 * end.wall_s:
            told += f", in {duration_text(end.at_limit_s)} if every trial lasts to its step limit"
        return told

"""When the run will end: from the durations that were measured, and where they are heading."""

from __future__ import annotations

import numpy as np

from sceann_hil.task import Task
from sceann_hil.timespans import duration_text

RECENT_GENERATIONS = 4
"""The newest generations, whose trials say what a trial takes now."""
LEAST_GENERATIONS = 4
"""Finished generations from which on a trend is looked for."""
TREND = 0.85
"""How much of the trend is believed; measured in ``tools/bench forecast``."""


class Forecast:
    """Learns from the trials of a run how long the rest will take.

    Attributes:
        task: whose trials they are.

    Args:
        task: whose trials they are.
        generations: number of the last generation.
        trials_per_generation: of a whole generation.
        longest_trial_s: robot time of a trial that reaches its step limit.
    """

    def __init__(self, task: Task, generations: int, trials_per_generation: int, longest_trial_s: float) -> None:
        self.task = task
        self._generations = generations
        self._trials_per_generation = trials_per_generation
        self._longest_trial_s = longest_trial_s
        self._robot_s: dict[int, list[float]] = {}
        self._before_begin_s: list[float] = []
        self._besides_s: list[float] = []
        self._generation = 0
        self._todo = trials_per_generation
        self._per_generation: list[int] = []

    def begin(self, generation: int, todo: int) -> None:
        """A generation begins, of which `todo` trials are still to be run."""
        self._generation, self._todo = generation, todo
        self._per_generation.append(todo)
        self._robot_s.setdefault(generation, []).extend(self._before_begin_s)
        self._before_begin_s = []

    def add(self, robot_s: float, besides_s: float) -> None:
        """One attempt has ended; `besides_s` is the time that it took besides robot time."""
        # a resumed run settles what was left unfinished before its generation begins
        self._robot_s.get(self._generation, self._before_begin_s).append(robot_s)
        self._besides_s.append(besides_s)
        self._todo = max(0, self._todo - 1)

    @property
    def trials_left(self) -> float:
        """Trials until the last generation is evaluated, if later generations need as many as the newest ones."""
        recent = self._per_generation[-RECENT_GENERATIONS:] or [self._trials_per_generation]
        later = max(0, self._generations - self._generation)
        return self._todo + later * float(np.mean(recent))

    def remaining_s(self, trials_left: float | None = None) -> tuple[float, float]:
        """Robot time and all time that so many more trials will take, by default all of the run."""
        trials_left = self.trials_left if trials_left is None else min(trials_left, self.trials_left)
        recent = self._besides_s[-RECENT_GENERATIONS * self._trials_per_generation :]
        besides_s = float(np.mean(recent)) if recent else 0.0
        robot_s = self.trial_s() * trials_left
        return robot_s, robot_s + besides_s * trials_left

    def trial_s(self) -> float:
        """Expected robot time of one of the trials to come."""
        by_generation = {number: durations for number, durations in sorted(self._robot_s.items()) if durations}
        measured = list(by_generation.values())
        if not measured:
            return self._longest_trial_s
        means = np.array([np.mean(generation) for generation in measured])
        recent_s = float(np.mean(np.concatenate(measured[-RECENT_GENERATIONS:])))
        if len(means) <= LEAST_GENERATIONS:
            return recent_s
        # evolution is fast at first: durations run about straight over the logarithm of the generation
        progress = np.log1p(np.array(list(by_generation)))
        slope = float(np.polyfit(progress[:-1], means[:-1], 1)[0])
        ahead = np.log1p(np.arange(self._generation, max(self._generations, self._generation) + 1)).mean()
        expected_s = recent_s + TREND * slope * float(ahead - progress[-RECENT_GENERATIONS:].mean())
        return float(np.clip(expected_s, 0.3 * recent_s, self._longest_trial_s))

    def text(self, trials_of_budget: float) -> str:
        """For people: when the run ends, or its budget before it."""
        if not self._besides_s:
            return ""
        left_s = self.remaining_s(trials_of_budget)[1]
        what = "budget" if trials_of_budget < self.trials_left else "run"
        return f"{what} ends in about {duration_text(left_s)}"

"""When the run will end: from the durations that were measured, where they are heading, and what the budget allows."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.robot.task import Task
from sceann_hil.supervision.budget import Amounts
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

    Attributes:
        task: whose trials they are.

    Args:
        task: whose trials they are.
        generations: number of the last generation.
        trials_per_generation: of a whole generation.
        longest_trial_s: robot time of a trial that reaches its step limit.
        before: what generations cost in earlier sessions of the run.
    """

    def __init__(
        self,
        task: Task,
        generations: int,
        trials_per_generation: int,
        longest_trial_s: float,
        before: Iterable[tuple[int, Cost]] = (),
    ) -> None:
        self.task = task
        self._generations = generations
        self._trials_per_generation = trials_per_generation
        self._longest_trial_s = longest_trial_s
        self._costs = dict(before)
        self._generation = max(self._costs, default=0)
        self._todo = trials_per_generation

    def begin(self, generation: int, todo: int) -> None:
        """A generation begins, of which `todo` trials are still to be run."""
        self._generation, self._todo = generation, todo

    def _size(self, generation: int, todo: int = 0) -> int:
        """Trials of a generation in all, as far as attempts tell: races may need fewer than were to do."""
        done = self._costs[generation].attempts if generation in self._costs else 0
        return min(done + todo, self._trials_per_generation)

    def add(self, robot_s: float, besides_s: float) -> None:
        """One attempt of this generation has ended."""
        cost = self._costs.setdefault(self._generation, Cost())
        cost.attempts += 1
        cost.robot_s += robot_s
        cost.besides_s += besides_s
        self._todo = max(0, self._todo - 1)

    def ending(self, left: Amounts, battery_per_trial: float = 0.0) -> Ending:
        """When the run ends.

        Args:
            left: what the budget still allows.
            battery_per_trial: fraction of a full battery that a trial takes.
        """
        trials = self._trials_to_come()
        robot_s = self._trial_s(self._generation + np.arange(len(trials)))
        by_budget, n, wall_s = self._end(trials, robot_s, left, battery_per_trial)
        at_limit_s = self._end(trials, np.full(len(trials), self._longest_trial_s), left, battery_per_trial)[2]
        return Ending(by_budget, n, wall_s, at_limit_s)

    def _end(
        self, trials: NDArray[np.float64], robot_s: NDArray[np.float64], left: Amounts, battery_per_trial: float
    ) -> tuple[bool, float, float]:
        """Whether a budget ends it, trials and time until then, if a trial of each generation takes so long."""
        n, besides_s = len(trials), self._besides_s()
        each = np.stack([robot_s, robot_s + besides_s, np.ones(n), np.full(n, battery_per_trial)], axis=1)
        passed = np.cumsum(trials[:, None] * each, axis=0)
        limits = np.array(astuple(left))
        over = (passed > limits).any(axis=1)
        if not over.any():
            return False, float(trials.sum()), float(passed[-1, 1])
        last = int(over.argmax())
        before = passed[last - 1] if last else np.zeros(4)
        costs = each[last] > 0.0
        room = max(0.0, float(((limits - before)[costs] / each[last][costs]).min()))
        return True, float(trials[:last].sum()) + room, float(before[1] + room * each[last, 1])

    def _trials_to_come(self) -> NDArray[np.float64]:
        """Trials of this generation and of every later one, if those need as many as the newest finished ones."""
        finished = range(max(0, self._generation - RECENT_GENERATIONS), self._generation)
        # a resumed generation is as large as any other, although little of it may be left
        recent = [self._size(number) for number in finished] or [self._size(self._generation, self._todo)]
        later = max(0, self._generations - self._generation)
        return np.concatenate([[self._todo], np.full(later, np.mean(recent))])

    def _measured(self) -> list[tuple[int, Cost]]:
        """Generations with attempts, in order."""
        return [(number, cost) for number, cost in sorted(self._costs.items()) if cost.attempts]

    def _besides_s(self) -> float:
        recent = [cost for _, cost in self._measured()[-RECENT_GENERATIONS:]]
        return sum(cost.besides_s for cost in recent) / max(1, sum(cost.attempts for cost in recent))

    def _trial_s(self, generations: NDArray[np.int64]) -> NDArray[np.float64]:
        """Expected robot time of a trial of each of these generations, which are still to come."""
        measured = self._measured()
        if not measured:
            return np.full(len(generations), self._longest_trial_s)
        recent = [cost for _, cost in measured[-RECENT_GENERATIONS:]]
        recent_s = sum(cost.robot_s for cost in recent) / sum(cost.attempts for cost in recent)
        if len(measured) <= LEAST_GENERATIONS:
            return np.full(len(generations), recent_s)
        # evolution is fast at first: durations run about straight over the logarithm of the generation
        progress = np.log1p([number for number, _ in measured])
        means = np.array([cost.robot_s / cost.attempts for _, cost in measured])
        slope = float(np.polyfit(progress[:-1], means[:-1], 1)[0])
        ahead = np.log1p(generations) - progress[-RECENT_GENERATIONS:].mean()
        expected_s = recent_s + TREND * slope * ahead
        return np.asarray(np.clip(expected_s, 0.3 * recent_s, self._longest_trial_s), np.float64)

    def text(self, left: Amounts, battery_per_trial: float = 0.0) -> str:
        """For people: when the run ends, or its budget before it."""
        if not self._measured():
            return ""
        end = self.ending(left, battery_per_trial)
        told = f"{'budget' if end.by_budget else 'run'} ends in about {duration_text(end.wall_s)}"
        if abs(end.at_limit_s - end.wall_s) > 0.2 * end.wall_s:
            told += f", in {duration_text(end.at_limit_s)} if every trial lasts to its step limit"
        return told

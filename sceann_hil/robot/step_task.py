"""Tasks whose fitness adds up over a trial; what an author gives is a `StepValue`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import inf

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sceann_hil.errors import PluginError
from sceann_hil.robot import Results, RobotSpec
from sceann_hil.robot.accumulation import Accumulation, Combine
from sceann_hil.robot.step_value import StepValue
from sceann_hil.robot.task import Task


class StepTask(Task):
    """A trial is worth what its steps add up to.

    Args:
        value: of one step.
        max_steps: a trial ends after this many steps.
        start_fields: what the values of a start are; a robot must have the same.
        starts: start values of an individual's trials, shape ``(n_trials, n_start)``.
        combine: what the steps add up to: mean, mean_of_all (over `max_steps`), sum, min, max or last.
        succeeded: which fitness values, shape ``(n,)``, count as a success; none if it is not given.
        best_fitness: no trial can be worth more; racing needs it.
        worst_fitness: no trial can be worth less; racing needs it.
        name: for messages; the value's name if it is not given.
        goal_by_operator: the robot cannot tell that the trial may end; a person says so.
        instruction: what a person has to do before the trial of this number.
        draw: starts of trials, from their numbers and keys (see `Task.starts_of`); `starts` if it is not given.
    """

    def __init__(
        self,
        *,
        value: StepValue,
        max_steps: int,
        start_fields: Sequence[str],
        starts: ArrayLike,
        combine: Combine | str = Combine.MEAN,
        succeeded: Callable[[NDArray[np.float64]], ArrayLike] | None = None,
        best_fitness: float = inf,
        worst_fitness: float = -inf,
        name: str | None = None,
        goal_by_operator: bool = False,
        instruction: Callable[[int], str] | None = None,
        draw: Callable[[NDArray[np.int64], NDArray[np.uint64]], NDArray[np.float64]] | None = None,
    ) -> None:
        if not isinstance(value, StepValue):
            raise PluginError(
                f"value: expected a function made by step_value, got {value!r}.", "Decorate it: @step_value."
            )
        try:
            rule = Combine(combine)
        except ValueError:
            raise PluginError(f"combine: expected {', '.join(Combine)}, got {combine!r}.") from None
        self._adds_up = self.accumulation = Accumulation(value, rule, max_steps)
        self.name = name or value.function.__name__
        self.max_steps = max_steps
        self.start_fields = tuple(start_fields)
        self.best_fitness, self.worst_fitness = float(best_fitness), float(worst_fitness)
        self.goal_by_operator = goal_by_operator
        self._starts = np.array(starts, np.float64)
        self._succeeded = succeeded
        self._instruction = instruction
        self._draw, self.draws_starts = draw, draw is not None

    @property
    def starts(self) -> NDArray[np.float64]:
        return self._starts

    def starts_of(self, trial: NDArray[np.int64], keys: NDArray[np.uint64]) -> NDArray[np.float64]:
        return super().starts_of(trial, keys) if self._draw is None else self._draw(trial, keys)

    def check_robot(self, spec: RobotSpec) -> None:
        """Refuse a robot of which the value of a step cannot be computed.

        Raises:
            PluginError: the value's own fault, with file and line.
            ValueError: see `Task.check_robot`.
        """
        super().check_robot(spec)
        self._adds_up.value.check(spec)

    def fitness(self, results: Results) -> NDArray[np.float64]:
        if results.values is None:
            if not results.counts.any():
                return np.full(len(results), np.nan)
            raise ValueError("results: expected the totals of the trials' steps, see Trials.completed")
        return self._adds_up.worth(results.values, results.steps)

    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        if self._succeeded is None:
            return np.zeros(len(results), np.bool_)
        reached = np.asarray(self._succeeded(self.fitness(results)), np.bool_)
        return np.asarray(np.broadcast_to(reached, (len(results),)) & results.counts)

    def instruction(self, trial: int) -> str:
        return super().instruction(trial) if self._instruction is None else self._instruction(trial)

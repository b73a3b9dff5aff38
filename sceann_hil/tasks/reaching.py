"""What tasks of reaching a target share: be as fast as you can. Katada & Nakazawa, Eq. (3)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.robot import EndReason, Results
from sceann_hil.robot.task import Task
from sceann_hil.tasks.drawn_starts import Draw
from sceann_hil.tasks.starts import START_FIELDS, Start, as_rows, instruction


class ReachTarget(Task):
    """Fitness of a trial is 1 - steps / max_steps, and 0 if the target was not reached.

    Args:
        max_steps: a trial ends after this many steps.
        starts: x and y in metres, heading in degrees, one trial for each.
        goal_by_operator: a person says when the target is reached.
        draw: starts of trials, from their numbers and keys (see `Task.starts_of`); `starts` if it is not given.
    """

    start_fields = START_FIELDS
    best_fitness = 1.0

    def __init__(
        self, max_steps: int, starts: tuple[Start, ...], goal_by_operator: bool, draw: Draw | None = None
    ) -> None:
        self.max_steps = max_steps
        self.goal_by_operator = goal_by_operator
        self._given = starts
        self._starts = as_rows(starts)
        self._draw, self.draws_starts = draw, draw is not None

    @property
    def starts(self) -> NDArray[np.float64]:
        return self._starts

    def starts_of(self, trial: NDArray[np.int64], keys: NDArray[np.uint64]) -> NDArray[np.float64]:
        return super().starts_of(trial, keys) if self._draw is None else self._draw(trial, keys)

    def fitness(self, results: Results) -> NDArray[np.float64]:
        return np.where(self.succeeded(results), 1.0 - results.steps / self.max_steps, 0.0)

    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        return np.asarray(results.end_reasons == EndReason.GOAL)

    def instruction(self, trial: int) -> str:
        return instruction(self._given[trial])

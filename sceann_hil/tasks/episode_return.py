"""What an environment itself rewards: the sum of a trial's rewards, as reinforcement learning has it."""

from __future__ import annotations

from math import inf
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from sceann_hil.plugins import TaskConfig
from sceann_hil.robot import Results
from sceann_hil.robot.task import Task


class EpisodeReturnConfig(TaskConfig):
    """The sum of the rewards that an environment gives: for robots of type gymnasium."""

    type: Literal["episode_return"] = "episode_return"
    max_steps: Annotated[int, Field(ge=1, le=65_535)] = 500
    """Steps after which a trial ends."""
    seeds: Annotated[tuple[Annotated[int, Field(ge=0, lt=2**31)], ...], Field(min_length=1, max_length=1000)] = (
        0,
        1,
        2,
        3,
        4,
    )
    """One trial for each: the episode begins with it."""
    success: float | None = None
    """A trial that is worth at least this counts as a success."""
    worst: float | None = None
    """The least that a trial can be worth; `sceann transfer` needs it."""
    best: float | None = None
    """The most that a trial can be worth; `sceann transfer` needs it."""

    def build(self) -> EpisodeReturn:
        return EpisodeReturn(self)


class EpisodeReturn(Task):
    """Fitness of a trial is the sum of the rewards of its steps.

    Args:
        config: its settings.
    """

    name = "episode_return"
    start_fields = ("seed",)

    def __init__(self, config: EpisodeReturnConfig = EpisodeReturnConfig()) -> None:  # noqa: B008
        self.max_steps = config.max_steps
        self.worst_fitness = -inf if config.worst is None else config.worst
        self.best_fitness = inf if config.best is None else config.best
        self._seeds = np.array(config.seeds, np.float64)[:, None]
        self._success = config.success

    @property
    def starts(self) -> NDArray[np.float64]:
        return self._seeds

    def fitness(self, results: Results) -> NDArray[np.float64]:
        if results.values is None:
            if not results.counts.any():
                return np.full(len(results), np.nan)
            raise ValueError("results: expected the sum of each trial's rewards, which this robot does not tell")
        return results.values

    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        if self._success is None:
            return np.zeros(len(results), np.bool_)
        return np.asarray((self.fitness(results) >= self._success) & results.counts)

"""What a trial is: where it starts, how long it may last, and what it is worth."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from sceann_hil.robot import Results


class Task(ABC):
    """A task maps trials to fitness; fitness is maximised.

    Attributes:
        name: a short name for messages.
        max_steps: a trial that lasts this long ends with `EndReason.TIME_UP`.
        start_fields: what the values of a start are; a robot must have the same.
        best_fitness: no trial can be worth more (for the axes of plots, and for racing).
        worst_fitness: no trial can be worth less.
        goal_by_operator: the robot cannot tell that the goal is reached; a person says so.
    """

    name: str
    max_steps: int
    start_fields: tuple[str, ...]
    best_fitness: float
    worst_fitness: float = 0.0
    goal_by_operator: bool = False

    @property
    @abstractmethod
    def starts(self) -> NDArray[np.float64]:
        """Start values of an individual's trials, shape ``(n_trials, n_start)``."""

    @abstractmethod
    def fitness(self, results: Results) -> NDArray[np.float64]:
        """Fitness of each trial, shape ``(n,)``; of no meaning where a trial's end was void."""

    @abstractmethod
    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        """Which trials reached what the task asks for, shape ``(n,)``."""

    def instruction(self, trial: int) -> str:
        """What a person has to do before one of an individual's trials."""
        start = zip(self.start_fields, self.starts[trial].tolist(), strict=True)
        return "Put the robot at its start: " + ", ".join(f"{name} = {value:.4g}" for name, value in start) + "."

    @property
    def n_trials(self) -> int:
        """Trials of one individual."""
        return len(self.starts)

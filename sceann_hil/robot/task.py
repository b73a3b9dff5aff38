"""What a trial is: where it starts, how long it may last, and what it is worth."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sceann_hil.network.coding import Weights
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import Results, RobotSpec, Trials
from sceann_hil.robot.trials import MOST_STEPS

if TYPE_CHECKING:
    from sceann_hil.robot.accumulation import Accumulation


class Task(ABC):
    """A task maps trials to fitness; fitness is maximised.

    Attributes:
        name: a short name for messages.
        max_steps: a trial that lasts this long ends with `EndReason.TIME_UP`.
        start_fields: what the values of a start are; a robot must have the same.
        best_fitness: no trial can be worth more (for the axes of plots, and for racing).
        worst_fitness: no trial can be worth less.
        goal_by_operator: the robot cannot tell that the goal is reached; a person says so.
        score_by_operator: a person says after a trial how good it was, 0 to 9: that is `Results.values`.
        accumulation: what it adds up over a trial's steps, if it does (`sceann_hil.robot.step_task`).
        draws_starts: a trial's start depends on its key, so equal genomes need not do the same.
    """

    name: str
    max_steps: int
    start_fields: tuple[str, ...]
    best_fitness: float
    worst_fitness: float = 0.0
    goal_by_operator: bool = False
    score_by_operator: bool = False
    accumulation: Accumulation | None = None
    draws_starts: bool = False

    @property
    @abstractmethod
    def starts(self) -> NDArray[np.float64]:
        """Start values of an individual's trials, shape ``(n_trials, n_start)``."""

    def starts_of(self, trial: NDArray[np.int64], keys: NDArray[np.uint64]) -> NDArray[np.float64]:
        """Where some trials start, shape ``(n, n_start)``: at the task's starts, unless it draws them.

        Args:
            trial: which of the task's trials each is, shape ``(n,)``.
            keys: its 64-bit noise key from the seed tree, shape ``(n,)``.
        """
        return self.starts[trial]

    @abstractmethod
    def fitness(self, results: Results) -> NDArray[np.float64]:
        """Fitness of each trial, shape ``(n,)``; of no meaning where a trial's end was void."""

    @abstractmethod
    def succeeded(self, results: Results) -> NDArray[np.bool_]:
        """Which trials reached what the task asks for, shape ``(n,)``."""

    def measure_names(self, spec: RobotSpec) -> tuple[str, ...]:
        """Names, with units, of what `measures` tells of a trial: by default the fields of the body's state.

        Algorithms that look for different controllers, not only for good ones, are told them.
        """
        return spec.state_fields

    def measures(self, results: Results) -> NDArray[np.float64]:
        """What the trials did besides their fitness, shape ``(n, n_measures)``: by default the state at their end.

        It may depend on whatever a journal keeps of a trial, so on all fields of `results` but the traces.
        """
        return results.final_states.astype(np.float64)

    def check_robot(self, spec: RobotSpec) -> None:
        """Refuse a robot whose trials could not be this task's; asked of every task before anything runs.

        Raises:
            ValueError: why it cannot.
        """
        if self.start_fields != spec.start_fields:
            raise ValueError(
                f"the task {self.name} starts its trials from {_listed(self.start_fields)}, but the robot {spec.name} "
                f"from {_listed(spec.start_fields)}"
            )
        starts = np.asarray(self.starts)
        if starts.ndim != 2 or len(starts) < 1 or starts.shape[1] != len(self.start_fields):
            raise ValueError(
                f"starts of the task {self.name}: expected one row of {len(self.start_fields)} values "
                f"({_listed(self.start_fields)}) for each trial, got shape {starts.shape}"
            )
        if starts.dtype.kind not in "iuf" or not np.isfinite(starts).all():
            raise ValueError(f"starts of the task {self.name}: expected finite numbers, got {starts.tolist()}")
        if not 1 <= self.max_steps <= MOST_STEPS:
            raise ValueError(f"max_steps of the task {self.name}: expected 1..{MOST_STEPS}, got {self.max_steps}")

    def trials(
        self,
        phenotype: Phenotype,
        weights: Weights,
        individual: ArrayLike,
        trial: ArrayLike,
        keys: ArrayLike,
        ids: NDArray[np.int64] | None = None,
        *,
        starts: NDArray[np.float64] | None = None,
        run_id: int = 0,
    ) -> Trials:
        """Trials of this task: the one place where genomes and task become something that a robot can run.

        `individual`, `trial` and `keys` broadcast against each other; their elements in C order are the trials. So
        ``np.arange(g)[:, None]`` and ``np.arange(task.n_trials)`` are all trials of g individuals.

        Args:
            phenotype: what the weights are of.
            weights: decoded genomes, shape ``(g, n_neurons, n_sources)``.
            individual: which of them does each trial, 0..g-1.
            trial: which of the task's trials it is, 0..n_trials-1.
            keys: its 64-bit noise key from the seed tree.
            ids: numbers that name the trials in the journal, int64, shape ``(n,)``; 0, 1, 2, ... if nobody says.
            starts: start values of trials that are in the journal already, shape ``(n, n_start)``; otherwise the
                task's own.
            run_id: see `Trials`.

        Raises:
            ValueError: see `Trials`; or starts of another number of values than the task's.
        """
        if starts is not None and np.shape(starts)[1:] != (len(self.start_fields),):
            expected = f"{len(self.start_fields)} values ({_listed(self.start_fields)})"
            raise ValueError(f"starts: expected {expected} for each trial, got shape {np.shape(starts)}")
        individual, trial, noise = (np.ravel(array) for array in np.broadcast_arrays(individual, trial, keys))
        return Trials(
            size=phenotype.size,
            dynamics=phenotype.dynamics,
            weights=weights,
            genome_index=individual.astype(np.int32),
            starts=self.starts_of(trial, noise.astype(np.uint64)) if starts is None else starts,
            keys=noise.astype(np.uint64),
            max_steps=self.max_steps,
            ids=np.arange(len(individual)) if ids is None else ids,
            run_id=run_id,
            accumulation=self.accumulation,
        )

    def instruction(self, trial: int) -> str:
        """What a person has to do before one of an individual's trials."""
        start = zip(self.start_fields, self.starts[trial].tolist(), strict=True)
        return "Put the robot at its start: " + ", ".join(f"{name} = {value:.4g}" for name, value in start) + "."

    @property
    def n_trials(self) -> int:
        """Trials of one individual."""
        return len(self.starts)


def _listed(fields: tuple[str, ...]) -> str:
    return ", ".join(fields) or "nothing"

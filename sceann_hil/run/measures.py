"""More than one number for each individual: what a task measures of its trials, for algorithms that want it.

Measures depend on nothing but what the journal keeps of a trial, so a resumed run is told the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig
from sceann_hil.journal import JournalReader
from sceann_hil.robot import Results
from sceann_hil.robot.task import Task


@dataclass(frozen=True, slots=True)
class Measures:
    """Which measures an experiment's algorithm wants, and where they come from.

    Attributes:
        task: measures its trials.
        columns: which of the task's measures, in the order of the algorithm.
    """

    task: Task
    columns: tuple[int, ...]

    @classmethod
    def of(cls, config: ExperimentConfig) -> Measures | None:
        """None if the algorithm wants none."""
        if not config.algorithm.measures:
            return None
        task = config.build_task()
        offered = task.measure_names(config.robot.spec)
        return cls(task, tuple(offered.index(name) for name in config.algorithm.measures))

    def of_trials(self, results: Results) -> NDArray[np.float64]:
        """What each trial measured, shape ``(n, k)``.

        Raises:
            ValueError: the task does not measure one finite number of each kind for each trial.
        """
        measured = np.asarray(self.task.measures(results), np.float64)
        if measured.ndim != 2 or len(measured) != len(results) or measured.shape[1] <= max(self.columns):
            raise ValueError(f"measures: expected a row for each of {len(results)} trials, got {measured.shape}")
        if not np.isfinite(measured).all():
            raise ValueError(f"measures: expected finite numbers of task {self.task.name}, got NaN or infinity")
        return measured[:, self.columns]

    def of_generation(self, reader: JournalReader, number: int, population: int) -> NDArray[np.float64]:
        """Mean over each individual's trials of a finished generation, shape ``(population, k)``."""
        rows = [row for row in reader.attempts(number) if row.fitness is not None]
        values = None if any(row.value is None for row in rows) else np.array([row.value for row in rows], np.float64)
        results = Results(
            end_reasons=np.array([row.end_reason for row in rows], np.uint8),
            steps=np.array([row.steps for row in rows], np.int32),
            hashes=np.array([row.state_hash for row in rows], np.uint16),
            final_states=np.array([row.final_state for row in rows], np.float32),
            durations_s=np.array([row.robot_s for row in rows], np.float64),
            values=values,
        )
        of_trials = np.empty((population, self.task.n_trials, len(self.columns)))
        of_trials[[row.individual for row in rows], [row.trial for row in rows]] = self.of_trials(results)
        return np.asarray(of_trials.mean(axis=1), np.float64)

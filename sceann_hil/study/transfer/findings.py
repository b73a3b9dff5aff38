"""What a transfer's journal says: trials, expectations before each, and what follows for the robot."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig, journalled_config
from sceann_hil.journal import JournalReader
from sceann_hil.network.coding import genome_to_hex
from sceann_hil.run.transfer.again import read_transfer, resemblance
from sceann_hil.run.transfer.robots import DrawnRobots, robot_with
from sceann_hil.run.transfer.settings import TransferConfig
from sceann_hil.run.transfer.state import TransferState
from sceann_hil.study.statistics import student_quantile


@dataclass(frozen=True, slots=True)
class Fresh:
    """The recommended controller's fresh trials, n of them.

    Attributes:
        values: fitness, shape ``(n,)``.
        succeeded: part that succeeded; None if success is not a matter of fitness.
    """

    values: NDArray[np.float64]
    succeeded: float | None

    @property
    def mean(self) -> float:
        """Of the fitness."""
        return float(self.values.mean())

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % of the mean; None of less than 3 trials."""
        n = len(self.values)
        if n < 3:
            return None
        half = float(student_quantile(0.975, n - 1) * self.values.std(ddof=1) / np.sqrt(n))
        return self.mean - half, self.mean + half


@dataclass(frozen=True)
class Findings:
    """What is known at the end of a transfer, or where it stands.

    Attributes:
        config: of the run.
        state: newest.
        history: what was expected before each trial: expected, interval, gain.
        fresh: the recommended controller's fresh trials; None before there are any.
        weights: how much the robot resembles each simulated one, shape ``(M,)``.
        robots: the simulated robots.
        before: mean and standard deviation of each drawn quantity, shape ``(2, P)``.
        after: the same after the trials.
        best_success: of any candidate in the ensemble; NaN if success is not a matter of fitness.
    """

    config: ExperimentConfig
    state: TransferState
    history: list[dict[str, Any]]
    fresh: Fresh | None
    weights: NDArray[np.float64]
    robots: DrawnRobots
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    best_success: float

    @classmethod
    def of(cls, directory: Path) -> Findings:
        """Of a transfer's folder.

        Raises:
            NotARun: it is none, or has no finished trial.
        """
        state, _ = read_transfer(directory)
        reader = JournalReader(directory)
        try:
            config = journalled_config(reader)
            history, values = _told(reader, config)
        finally:
            reader.close()
        prepared = config.algorithm.for_experiment(config).prepared_by().prepared(state.candidates)
        ensemble = prepared.ensemble
        drawn = ensemble.robots.values
        mean, covariance = prepared.fitness.condition(state.observed).mixture
        deviations = (drawn - drawn.mean(axis=0)) / np.sqrt(len(drawn))
        spread = np.sqrt(np.maximum(np.einsum("mp,mn,np->p", deviations, covariance, deviations), 0.0))
        level = ensemble.level
        fresh = None
        if values:
            some = np.array(values)
            fresh = Fresh(some, None if level is None else float((some >= level).mean()))
        return cls(
            config=config,
            state=state,
            history=history,
            fresh=fresh,
            weights=resemblance(ensemble, state.observed),
            robots=ensemble.robots,
            before=np.stack([drawn.mean(axis=0), drawn.std(axis=0)]),
            after=np.stack([drawn.mean(axis=0) + mean @ deviations, spread]),
            best_success=float(ensemble.success.max()),
        )

    @property
    def genome(self) -> str:
        """The recommended controller."""
        return genome_to_hex(self.state.candidates[self.state.recommended])

    @property
    def body(self) -> dict[str, Any]:
        """The section of a simulated robot that is as this one seems to be: the gap that follows."""
        body = self.robots.bodies[0]
        low, high = self.robots.values.min(axis=0), self.robots.values.max(axis=0)
        values = np.clip(self.after[0], low, high)
        return robot_with(body, self.robots.names, values)


def _told(reader: JournalReader, config: ExperimentConfig) -> tuple[list[dict[str, Any]], list[float]]:
    """What was said before each trial, with what it brought; and the fitness of all fresh trials."""
    if not isinstance(config.algorithm, TransferConfig):
        raise TypeError(f"algorithm: expected transfer, got {config.algorithm.type}")
    history, fresh = [], []
    for generation in reader.generations():
        told: dict[str, Any] = json.loads(reader.individuals(generation.number)[0].structure or "{}")
        values = [row.fitness for row in reader.attempts(generation.number) if row.fitness is not None]
        if told.get("start") is None:
            fresh += values
            told["fitness"] = None
        else:
            told["fitness"] = values[0] if values else None
        history.append(told)
    return history, fresh

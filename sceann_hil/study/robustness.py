"""How well controllers do in bodies that differ from the one they evolved in: which one to put on a robot.

A disturbance is a series of changes to the experiment's configuration, from none to severe. Every controller runs the
task's trials several times at every level, each time with noise of its own. It counts by its mean fitness, which every
task has, and by the part of its trials that reached what the task asks for.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from statistics import NormalDist
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.network.coding import Bits
from sceann_hil.run.batch import BatchEvaluator, Outcomes
from sceann_hil.seeds import Purpose, keys
from sceann_hil.study.statistics import LEVEL, Interval

REPEATS = 20
"""Times that a trial is repeated at every level."""

_GAP_SERIES: tuple[tuple[str, str, str, float, tuple[float, ...], bool, float], ...] = (
    ("sensor_noise", "sensor noise", "% of full scale", 100.0, (0.0, 0.002, 0.005, 0.01, 0.02, 0.05), False, 0.0),
    (
        "sensor_offset",
        "sensor offset",
        "% of full scale (s.d.)",
        100.0,
        (0.0, 0.0002, 0.0005, 0.001, 0.005, 0.02),
        True,
        0.0,
    ),
    ("motor_gain", "motor gain error", "% (s.d.)", 100.0, (0.0, 0.05, 0.1, 0.2, 0.3, 0.5), True, 1.0),
    ("latency_steps", "latency", "control steps", 1.0, (0.0, 1.0, 2.0, 3.0, 4.0, 5.0), False, 0.0),
)
"""Key of the gap, name, unit, scale of the unit, levels, drawn from a normal distribution, and its mean."""


class Criterion(StrEnum):
    """What controllers are compared by."""

    FITNESS = "fitness"
    """Mean fitness."""
    SUCCESS = "success"
    """Part of trials that reached what the task asks for."""


@dataclass(frozen=True, slots=True)
class Disturbance:
    """One way in which a body can differ.

    Attributes:
        name: for people.
        unit: of the levels times `scale`.
        scale: factor with which levels are shown.
        levels: how much; the first is no disturbance.
        changes: what each level changes in the configuration, by dotted key.
    """

    name: str
    unit: str
    scale: float
    levels: tuple[float, ...]
    changes: tuple[Mapping[str, Any], ...]


@dataclass(frozen=True)
class Robustness:
    """What was measured (g genomes).

    Attributes:
        disturbances: the ways in which bodies differed.
        success: for each disturbance the part of trials that succeeded, float64, shape ``(n_levels, g)``.
        fitness: for each disturbance the mean fitness, float64, shape ``(n_levels, g)``.
        variance: of these means, in the same shape.
        score: mean over the disturbances of the mean success over their levels, the undisturbed one left out; shape
            ``(g,)``.
        repeats: of every trial.
    """

    disturbances: tuple[Disturbance, ...]
    success: tuple[NDArray[np.float64], ...]
    fitness: tuple[NDArray[np.float64], ...]
    variance: tuple[NDArray[np.float64], ...]
    score: NDArray[np.float64] = field(repr=False)
    repeats: int = REPEATS

    def mean(self, criterion: Criterion) -> NDArray[np.float64]:
        """Mean over the disturbances of the mean over their levels, the undisturbed one left out, shape ``(g,)``."""
        return self.score if criterion is Criterion.SUCCESS else _over_levels(self.fitness)

    def fitness_interval(self, genome: int) -> Interval:
        """Mean fitness in disturbed bodies of one genome, with its 95 % interval."""
        return self._interval(float(self.mean(Criterion.FITNESS)[genome]), float(self._variances[genome]))

    def fitness_difference(self, one: int, other: int) -> Interval:
        """Mean fitness of one genome minus that of another, with its 95 % interval."""
        means, variances = self.mean(Criterion.FITNESS), self._variances
        return self._interval(float(means[one] - means[other]), float(variances[one] + variances[other]))

    @property
    def _variances(self) -> NDArray[np.float64]:
        weights = [1.0 / (len(self.variance) * (len(levels) - 1)) for levels in self.variance]
        parts = [w**2 * levels[1:].sum(axis=0) for w, levels in zip(weights, self.variance, strict=True)]
        return np.asarray(np.sum(parts, axis=0))

    def _interval(self, mean: float, variance: float) -> Interval:
        reach = float(NormalDist().inv_cdf(0.5 + LEVEL / 2.0) * np.sqrt(variance)) if self.repeats > 1 else float("inf")
        return Interval(mean, mean - reach, mean + reach)


def disturbances_of(config: ExperimentConfig) -> tuple[Disturbance, ...]:
    """The disturbances that an experiment's robot and task know.

    Raises:
        ConfigError: the robot has no reality gap that could be changed.
    """
    if "gap" not in type(config.robot).model_fields:
        raise ConfigError(
            f"robot.type: robustness is measured in simulation, by changing robot.gap; {config.robot.type} has none",
            "Name a run or a study of a simulated robot.",
        )
    gap = config.robot.model_dump()["gap"]
    # one robot for its whole life would be the same body in every trial
    each_trial = {"robot.gap.drawn": "per_trial"} if gap.get("drawn", "per_trial") != "per_trial" else {}
    series = [_gap_series(each_trial, *one) for one in _GAP_SERIES if one[0] in gap]
    starts = config.task.other_starts()
    if starts is not None:
        changes = tuple({f"task.{key}": value for key, value in level.items()} for level in starts.changes)
        series.append(Disturbance(starts.name, starts.unit, 1.0, starts.levels, changes))
    return tuple(series)


def measure(config: ExperimentConfig, genomes: Bits, repeats: int = REPEATS) -> Robustness:
    """Run every genome under every disturbance.

    Args:
        config: the experiment that they come from; its seed is the root of the noise.
        genomes: bits, shape ``(g, L)``.
        repeats: of every trial.

    Raises:
        ConfigError: the robot has no reality gap that could be changed.
        TrialVoid: a trial ended without a result.
    """
    found = disturbances_of(config)
    success, fitness, variance = [], [], []
    for number, disturbance in enumerate(found):
        levels = [
            _outcomes(config.with_changes(changes), genomes, repeats, number, level)
            for level, changes in enumerate(disturbance.changes)
        ]
        success.append(np.stack([level.succeeded.mean(axis=1) for level in levels]))
        fitness.append(np.stack([level.mean_fitness for level in levels]))
        variance.append(np.stack([_variance_of_mean(level, repeats) for level in levels]))
    return Robustness(found, tuple(success), tuple(fitness), tuple(variance), _over_levels(success), repeats)


def _outcomes(config: ExperimentConfig, genomes: Bits, repeats: int, disturbance: int, level: int) -> Outcomes:
    """All trials of every genome; the repeats follow each other, shape ``(g, repeats * n_trials)``."""
    with config.robot.build() as robot:
        batch = BatchEvaluator.of(config, robot)
        n_trials = batch.task.n_trials
        number, trial = np.arange(len(genomes))[:, None], np.arange(n_trials * repeats)
        noise = keys(config.seed, Purpose.TRIAL, disturbance, level, number, trial)
        return batch.evaluate(genomes, noise, np.tile(np.arange(n_trials), repeats))


def _variance_of_mean(outcomes: Outcomes, repeats: int) -> NDArray[np.float64]:
    """Of each genome's mean fitness, from how its repeats differ, shape ``(g,)``; 0 with a single repeat."""
    each = outcomes.fitness.reshape(len(outcomes.fitness), repeats, -1).mean(axis=2)
    return np.asarray(each.var(axis=1, ddof=1) / repeats) if repeats > 1 else np.zeros(len(each))


def _over_levels(levels: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.asarray(np.mean([one[1:].mean(axis=0) for one in levels], axis=0))


def _gap_series(
    always: Mapping[str, Any],
    key: str,
    name: str,
    unit: str,
    scale: float,
    levels: tuple[float, ...],
    drawn: bool,
    mean: float,
) -> Disturbance:
    values: list[Any] = [{"normal": [mean, level]} if drawn else level for level in levels]
    changes = tuple(
        {f"robot.gap.{key}": value, **always} if level else dict(always)
        for level, value in zip(levels, values, strict=True)
    )
    return Disturbance(name, unit, scale, levels, changes)

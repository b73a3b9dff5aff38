"""How well controllers do in bodies that differ from the one they evolved in: which one to put on a robot.

A disturbance is a series of changes to the experiment's configuration, from none to severe. Every controller runs the
task's trials several times at every level, each time with noise of its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.network.coding import Bits
from sceann_hil.seeds import Purpose, keys

REPEATS = 20
"""Times that a trial is repeated at every level."""
_TRIALS_AT_ONCE = 100_000


@dataclass(frozen=True, slots=True)
class Disturbance:
    """One way in which a body can differ.

    Attributes:
        name: for people.
        unit: of the levels times `scale`.
        scale: factor with which levels are shown.
        levels: how much; the first is no disturbance.
        settings: what each level changes in the configuration, as ``key=value``.
    """

    name: str
    unit: str
    scale: float
    levels: tuple[float, ...]
    settings: tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class Robustness:
    """What was measured (g genomes).

    Attributes:
        disturbances: the ways in which bodies differed.
        success: for each disturbance the part of trials that succeeded, float64, shape ``(n_levels, g)``.
        score: mean over the disturbances of the mean over their levels, the undisturbed one left out; shape ``(g,)``.
    """

    disturbances: tuple[Disturbance, ...]
    success: tuple[NDArray[np.float64], ...]
    score: NDArray[np.float64]


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
    return (
        _series(
            "sensor noise", "% of full scale", 100.0, (0.0, 0.002, 0.005, 0.01, 0.02, 0.05), "robot.gap.sensor_noise={}"
        ),
        _series(
            "sensor offset",
            "% of full scale (s.d.)",
            100.0,
            (0.0, 0.0002, 0.0005, 0.001, 0.005, 0.02),
            "robot.gap.sensor_offset={{normal: [0.0, {}]}}",
        ),
        _series(
            "motor gain error",
            "% (s.d.)",
            100.0,
            (0.0, 0.05, 0.1, 0.2, 0.3, 0.5),
            "robot.gap.motor_gain={{normal: [1.0, {}]}}",
        ),
        _series("latency", "control steps", 1.0, (0.0, 1.0, 2.0, 3.0, 4.0, 5.0), "robot.gap.latency_steps={}"),
        *_other_starts(config),
    )


def measure(config: ExperimentConfig, genomes: Bits, repeats: int = REPEATS) -> Robustness:
    """Run every genome under every disturbance.

    Args:
        config: the experiment that they come from; its seed is the root of the noise.
        genomes: bits, shape ``(g, L)``.
        repeats: of every trial.

    Raises:
        ConfigError: the robot has no reality gap that could be changed.
    """
    found = disturbances_of(config)
    success = []
    for number, disturbance in enumerate(found):
        levels = [
            _success(config.with_changes(settings=settings), genomes, repeats, number, level)
            for level, settings in enumerate(disturbance.settings)
        ]
        success.append(np.stack(levels))
    score = np.mean([levels[1:].mean(axis=0) for levels in success], axis=0)
    return Robustness(found, tuple(success), score)


def _success(
    config: ExperimentConfig, genomes: Bits, repeats: int, disturbance: int, level: int
) -> NDArray[np.float64]:
    """Part of each genome's trials that succeed, shape ``(g,)``."""
    task = config.task.build()
    per_genome = task.n_trials * repeats
    at_once = max(1, _TRIALS_AT_ONCE // per_genome)
    found = []
    with config.robot.build() as robot:
        for first in range(0, len(genomes), at_once):
            some = genomes[first : first + at_once]
            n = len(some)
            number = np.arange(first, first + n)[:, None]
            noise = keys(config.seed, Purpose.TRIAL, disturbance, level, number, np.arange(per_genome))
            trial = np.tile(np.arange(task.n_trials), repeats)
            weights = config.phenotype.decode(some)
            results = robot.run(task.trials(config.phenotype, weights, np.arange(n)[:, None], trial, noise))
            results.must_count()
            found.append(task.succeeded(results).reshape(n, per_genome).mean(axis=1))
    return np.concatenate(found)


def _series(name: str, unit: str, scale: float, levels: tuple[float, ...], template: str) -> Disturbance:
    settings = tuple((template.format(level),) if level else () for level in levels)
    return Disturbance(name, unit, scale, levels, settings)


def _other_starts(config: ExperimentConfig) -> tuple[Disturbance, ...]:
    """Other initial angles, for tasks that have one."""
    fields = type(config.task).model_fields
    if "start_angle_deg" in fields:
        before = float(config.task.model_dump()["start_angle_deg"])
        levels = (before, *(angle for angle in (2.0, 4.0, 6.0, 8.0, 12.0) if angle != before))
        settings = tuple((f"task.start_angle_deg={angle}",) for angle in levels)
        return (Disturbance("initial angle", "degrees", 1.0, levels, settings),)
    if "headings_deg" in fields:
        headings = np.array(config.task.model_dump()["headings_deg"])
        turns = (0.0, 5.0, 10.0, 15.0, 20.0, 22.5)
        settings = tuple((f"task.headings_deg={(headings + turn).tolist()}",) for turn in turns)
        return (Disturbance("initial headings turned by", "degrees", 1.0, turns, settings),)
    return ()

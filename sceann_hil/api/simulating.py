"""A controller in simulation, outside any run: to look at it, to disturb it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sceann_hil.api.individual import Individual
from sceann_hil.api.trial import Trial, trials_of
from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.run.rehearsal import simulated_body
from sceann_hil.seeds import Purpose, keys


def simulate(
    config: ExperimentConfig,
    individual: Individual,
    *,
    gap: Mapping[str, Any] | None = None,
    changes: Mapping[str, Any] | None = None,
    repeats: int = 1,
    seed: int = 0,
) -> list[Trial]:
    """Run all trials of a controller on the simulated body of an experiment, and keep every step.

    Args:
        config: the experiment; a real robot's place is taken by its simulated body.
        individual: the controller.
        gap: the body's `gap` section instead of the configured one, such as ``{"sensor_noise": 0.02}``.
        changes: further values by dotted key, such as ``{"robot.top_speed_m_s": 0.1}``.
        repeats: how often each of the task's trials is run, each time with other noise.
        seed: of the noise.

    Returns:
        The trials, all repeats of the first one, then of the second one, ...

    Raises:
        ConfigError: there is no simulated body, a change is wrong, or the controller does not fit.
        TrialVoid: a trial ended without a result.
    """
    if repeats < 1:
        raise ValueError(f"repeats: expected at least 1, got {repeats}")
    config = config.with_changes(robot=simulated_body(config))
    config = config.with_changes({**({} if gap is None else {"robot.gap": gap}), **(changes or {})})
    phenotype, expected = individual.phenotype, config.phenotype
    if phenotype.size != expected.size:
        raise ConfigError(
            f"individual: expected a controller for {expected.size}, got one for {phenotype.size}.",
            "Simulate it with the configuration that it was evolved with, or a body with as many sensors and motors.",
        )
    task = config.build_task()
    trial = np.repeat(np.arange(task.n_trials), repeats)
    noise = keys(seed, Purpose.REPEAT, trial, np.arange(len(trial)))
    with config.robot.build() as robot:
        evaluator = BatchEvaluator(phenotype, task, robot)
        results = evaluator.trace(individual.genome[None], noise, trial)
        return trials_of(
            results,
            task.fitness(results),
            task.succeeded(results),
            trial,
            [dict(zip(task.start_fields, start, strict=True)) for start in task.starts_of(trial, noise).tolist()],
            robot.spec.tick_s,
            phenotype.size,
            robot.spec.state_fields,
        )

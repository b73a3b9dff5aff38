"""The forecast of a run's end after a fifth of its trials, against when it did end, over many runs of both tasks.

Robot times are those of whole evolutions; a person's time per trial is drawn from a log-normal distribution (median
20 s, sigma 0.5), as the operator's column of a journal would hold it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from figures import Figure
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig, load_config
from sceann_hil.forecast import Forecast
from sceann_hil.robot import Robot, Trials
from sceann_hil.seeds import Purpose, generator, keys

CONFIGS = Path(__file__).parents[2] / "configs"
RUNS = 100
PERSON_S = 20.0
PART = 0.2


def run() -> list[Figure]:
    """Both tasks, with a person and without one."""
    figures = []
    for name in ("goal_reach", "pole_balancing"):
        config = load_config(CONFIGS / f"{name}.yaml", ("algorithm={type: sga}",))
        with config.robot.build() as robot:
            durations = _durations(config, robot)
        for person_s in (PERSON_S, 0.0):
            errors = np.abs([_error(config, run, person_s, number) for number, run in enumerate(durations)])
            whom = f"{person_s:g} s of a person per trial" if person_s else "nobody there"
            within = float((errors <= 0.1).mean())
            median = float(np.median(errors))
            figures.append(
                Figure(
                    f"{name.replace('_', ' ')}, {whom}",
                    f"median error {median:.1%}, within 10 % in {within:.0%} of {RUNS} runs",
                    "<= 10 %" if person_s else "",
                    median <= 0.1 if person_s else None,
                )
            )
    return figures


def _error(config: ExperimentConfig, durations_s: NDArray[np.float64], person_s: float, seed: int) -> float:
    """Relative error of the forecast of the whole time; `durations_s` has shape (generations, trials)."""
    generations, per_generation = durations_s.shape
    rng = np.random.default_rng(seed)
    besides_s = person_s * rng.lognormal(0.0, 0.5, durations_s.shape)
    task = config.task.build()
    forecast = Forecast(task, generations - 1, per_generation, task.max_steps * config.robot.spec.tick_s)
    seen = round(PART * durations_s.size)
    for number in range(generations):
        forecast.begin(number, per_generation)
        for trial in range(per_generation):
            forecast.add(float(durations_s[number, trial]), float(besides_s[number, trial]))
            seen -= 1
            if seen == 0:
                passed = np.arange(durations_s.size) <= number * per_generation + trial
                everything = (durations_s + besides_s).ravel()
                end_s = float(everything[passed].sum()) + forecast.remaining_s()[1]
                return end_s / float(everything.sum()) - 1.0
    raise RuntimeError("a run has more than a fifth of its trials")


def _durations(config: ExperimentConfig, robot: Robot) -> NDArray[np.float64]:
    """Robot time of every trial of every run, shape (runs, generations, trials)."""
    algorithm: Any = config.algorithm.build(config.genome_length)
    task, population = config.task.build(), config.algorithm.population
    states = [algorithm.start(generator(2000 + run, Purpose.ALGORITHM, 0)) for run in range(RUNS)]
    run_, individual, trial = (axis.ravel() for axis in np.indices((RUNS, population, task.n_trials)))
    durations = []
    for number in range(config.algorithm.generations + 1):
        genomes = np.concatenate([state.genomes for state in states])
        results = robot.run(
            Trials(
                size=config.size,
                dynamics=config.controller.dynamics,
                weights=config.controller.coding.decode(genomes, config.size),
                genome_index=(run_ * population + individual).astype(np.int32),
                starts=task.starts[trial],
                keys=keys(1, Purpose.TRIAL, number, run_, individual, trial),
                max_steps=task.max_steps,
                ids=np.arange(run_.size),
            )
        )
        durations.append(results.durations_s.reshape(RUNS, -1))
        fitness = task.fitness(results).reshape(RUNS, population, task.n_trials).mean(axis=2)
        states = [
            algorithm.tell(state, values, generator(2000 + run, Purpose.ALGORITHM, number + 1))
            for run, (state, values) in enumerate(zip(states, fitness, strict=True))
        ]
    return np.stack(durations, axis=1)

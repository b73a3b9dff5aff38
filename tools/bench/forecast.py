"""The forecast of a run's end after a fifth of it, against when it did end, over many runs of both tasks.

A run ends with its last generation, or before with a budget of robot time. Robot times are those of whole evolutions; a
person's time per trial is drawn from a log-normal distribution (median 20 s, sigma 0.5), as the operator's column of a
journal would hold it. The forecast's constants were chosen on seeds 2000 to 2099; these are others.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from figures import Figure
from many_runs import run_trials
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig, load_config
from sceann_hil.robot import Robot
from sceann_hil.seeds import Purpose, generator, keys
from sceann_hil.supervision.budget import Amounts
from sceann_hil.supervision.forecast import Forecast

CONFIGS = Path(__file__).parents[2] / "configs"
RUNS = 200
FIRST_SEED = 20_000
PERSON_S = 20.0
PART = 0.2
BUDGET = 0.5
"""Part of the whole run's robot time that a budget allows."""


def run() -> list[Figure]:
    """Both tasks, with a person and without one, with a budget and without one."""
    figures = []
    for name in ("goal_reach", "pole_balancing"):
        config = load_config(CONFIGS / f"{name}.yaml", ("algorithm={type: sga}",))
        with config.robot.build() as robot:
            durations = _durations(config, robot)
        for budget in (BUDGET, float("inf")):
            for person_s in (PERSON_S, 0.0):
                cases = [_Case(config, run, person_s, budget, number) for number, run in enumerate(durations)]
                figures.append(_figure(name.replace("_", " "), person_s, budget, cases))
    return figures


class _Case:
    """One run: what its trials took, and when it ended; `durations_s` has shape (generations, trials)."""

    def __init__(
        self, config: ExperimentConfig, durations_s: NDArray[np.float64], person_s: float, budget: float, seed: int
    ) -> None:
        self.per_generation = durations_s.shape[1]
        self.robot_s = durations_s.ravel()
        self.besides_s = person_s * np.random.default_rng(seed).lognormal(0.0, 0.5, durations_s.size)
        self.budget_s = budget * float(self.robot_s.sum()) if budget < 1.0 else float("inf")
        self.trials = int((np.cumsum(self.robot_s) <= self.budget_s).sum())
        self.whole_s = float((self.robot_s + self.besides_s)[: self.trials].sum())
        task = config.build_task()
        self.forecast = Forecast(len(durations_s) - 1, self.per_generation, task.max_steps * config.robot.spec.tick_s)

    def error(self) -> float:
        """Relative error of the forecast of the whole time, made when a fifth of it has passed."""
        passed_s = spent_s = 0.0
        for trial in range(self.trials):
            if trial % self.per_generation == 0:
                self.forecast.begin(trial // self.per_generation, self.per_generation)
            self.forecast.add([float(self.robot_s[trial])], float(self.besides_s[trial]))
            spent_s += float(self.robot_s[trial])
            passed_s += float(self.robot_s[trial] + self.besides_s[trial])
            if passed_s >= PART * self.whole_s:
                break
        left = replace(Amounts.unlimited(), robot_s=self.budget_s - spent_s)
        return (passed_s + self.forecast.ending(left).wall_s) / self.whole_s - 1.0


def _figure(task: str, person_s: float, budget: float, cases: list[_Case]) -> Figure:
    errors = np.abs([case.error() for case in cases])
    median, within = float(np.median(errors)), float((errors <= 0.1).mean())
    whom = f"{person_s:g} s of a person per trial" if person_s else "nobody there"
    until = f"budget of {budget:.0%} of its robot time" if budget < 1.0 else "no budget"
    promised = bool(person_s)
    return Figure(
        f"{task}, {until}, {whom}",
        f"median error {median:.1%}, within 10 % in {within:.0%} of {len(cases)} runs",
        "<= 10 %" if promised else "",
        median <= 0.1 if promised else None,
    )


def _durations(config: ExperimentConfig, robot: Robot) -> NDArray[np.float64]:
    """Robot time of every trial of every run, shape (runs, generations, trials)."""
    algorithm: Any = config.algorithm.build(config.genome_length)
    task, population = config.build_task(), config.algorithm.population
    states = [algorithm.start(generator(FIRST_SEED + run, Purpose.ALGORITHM, 0)) for run in range(RUNS)]
    run_, individual, trial = (axis.ravel() for axis in np.indices((RUNS, population, task.n_trials)))
    durations = []
    for number in range(config.algorithm.generations + 1):
        genomes = np.stack([state.genomes for state in states])
        key = keys(1, Purpose.TRIAL, number, run_, individual, trial)
        results = run_trials(config, robot, genomes, run_, individual, trial, key)
        durations.append(results.durations_s.reshape(RUNS, -1))
        fitness = task.fitness(results).reshape(RUNS, population, task.n_trials).mean(axis=2)
        states = [
            algorithm.tell(state, values, generator(FIRST_SEED + run, Purpose.ALGORITHM, number + 1))
            for run, (state, values) in enumerate(zip(states, fitness, strict=True))
        ]
    return np.stack(durations, axis=1)

"""Robot minutes to a given fitness on both of the paper's tasks: the plain GA is 1.0, each saving alone and together.

Many runs are evolved side by side (as `sceann_hil.study.blocks` does it), with the same seeds for every saving. A
run's robot time to a fitness is what its trials took until a generation's best individual, tested anew on fresh trials
that cost nothing, was that good; runs that never get there count with all their time, for every saving alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from figures import Figure
from many_runs import run_trials
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig, load_config
from sceann_hil.robot import Robot
from sceann_hil.seeds import Purpose, generator, keys
from sceann_hil.supervision.saving import Pool, Racing, SavingConfig, raced_fitness, rounds, still_open

CONFIGS = Path(__file__).parents[2] / "configs"
RUNS = 200
FIRST_SEED = 50_000
"""The savings' rules were chosen on seeds below; these are others."""
FRESH = 4
"""Fresh evaluations of a generation's best, for the test on a noisy task."""
MARGIN = 0.05
"""Final fitness is not worse if the whole interval of its difference lies above so much of the plain algorithm's."""
TASKS = {"goal reach": "goal_reach.yaml", "pole balancing": "pole_balancing.yaml"}
SAVINGS = {
    "plain": SavingConfig(),
    "identical genomes": SavingConfig(reuse=True, pool=1),
    "identical genomes, pool of 2": SavingConfig(reuse=True, pool=2),
    "racing, exact": SavingConfig(racing=Racing.EXACT),
    "racing, approximate": SavingConfig(racing=Racing.APPROXIMATE),
    "shuffled order": SavingConfig(shuffle=True),
    "together": SavingConfig(reuse=True, pool=1, racing=Racing.APPROXIMATE, shuffle=True),
}
FOR_ALGORITHM = {"sga": tuple(SAVINGS), "oga": ("plain", "identical genomes", "together")}


@dataclass
class Outcome:
    """What one saving did (r runs, g generations).

    Attributes:
        robot_s: robot time up to the end of each generation, shape ``(r, g)``.
        tested: best individual of each generation on fresh trials, shape ``(r, g)``.
    """

    robot_s: NDArray[np.float64]
    tested: NDArray[np.float64]


def run() -> list[Figure]:
    """The comparison on both tasks."""
    figures = []
    for algorithm, savings in FOR_ALGORITHM.items():
        for name, file in TASKS.items():
            config = load_config(CONFIGS / file, (f"algorithm={{type: {algorithm}}}",))
            with config.robot.build() as robot:
                outcomes = {saving: _evolve(config, robot, SAVINGS[saving]) for saving in savings}
            figures += _compare(name, algorithm, outcomes)
    return figures


def _compare(task: str, algorithm: str, outcomes: dict[str, Outcome]) -> list[Figure]:
    plain = outcomes["plain"]
    goal = float(np.median(plain.tested[:, -1])) if task == "goal reach" else float(plain.tested.mean(axis=0)[-1])
    margin = MARGIN * float(plain.tested[:, -1].mean())
    place = f"{task}, {algorithm.upper()}"
    figures = [Figure(f"{place}: fitness to reach", f"{goal:.4g} ({RUNS} runs; margin {margin:.3g})")]
    base = _minutes(plain, goal)
    for name, outcome in outcomes.items():
        minutes = _minutes(outcome, goal)
        ratio, low, high = _ratio(minutes, base)
        whole = outcome.robot_s[:, -1].sum() / plain.robot_s[:, -1].sum()
        difference = outcome.tested[:, -1] - plain.tested[:, -1]
        mean, half = difference.mean(), 1.96 * difference.std(ddof=1) / np.sqrt(RUNS)
        measured = (
            f"{ratio:.2f} [{low:.2f}, {high:.2f}] ({minutes.mean() / 60:.0f} min per run); all generations "
            f"{whole:.2f}; "
            f"final fitness {mean:+.3g} [{mean - half:+.3g}, {mean + half:+.3g}]"
        )
        together = name == "together"
        kept = bool(ratio <= 0.6 and mean - half >= -margin) if together else None
        figures.append(Figure(f"{place}: {name}", measured, "<= 0.6, not worse" if together else "", kept))
    return figures


def _minutes(outcome: Outcome, goal: float) -> NDArray[np.float64]:
    """Robot time of each run until it is that good, seconds."""
    reached = outcome.tested >= goal
    first = np.where(reached.any(axis=1), reached.argmax(axis=1), outcome.tested.shape[1] - 1)
    return outcome.robot_s[np.arange(len(first)), first]


def _ratio(some: NDArray[np.float64], base: NDArray[np.float64]) -> tuple[float, float, float]:
    """Ratio of the means with a bootstrap 95 % interval over runs (paired: equal seeds)."""
    rng = np.random.default_rng(1)
    which = rng.integers(0, len(base), (4000, len(base)))
    ratios = some[which].mean(axis=1) / base[which].mean(axis=1)
    return float(some.mean() / base.mean()), *np.quantile(ratios, (0.025, 0.975)).tolist()


def _evolve(config: ExperimentConfig, robot: Robot, saving: SavingConfig) -> Outcome:
    """All runs with one saving; the rules are the evaluator's, with every run's trials in one robot call per round."""
    algorithm: Any = config.algorithm.build(config.genome_length)
    task, population = config.build_task(), config.algorithm.population
    seeds = [FIRST_SEED + run for run in range(RUNS)]
    states = [algorithm.start(generator(seed, Purpose.ALGORITHM, 0)) for seed in seeds]
    noisy = not robot.spec.noise_free
    limit = saving.evaluations(noise_free=not noisy)
    pools = [Pool(task.n_trials, limit, noisy=noisy) if limit else None for _ in seeds]
    racing = saving.racing is not Racing.OFF
    spent = np.zeros(RUNS)
    robot_s, tested = [], []
    for number in range(config.algorithm.generations + 1):
        wanted = np.stack(
            [
                np.ones((population, task.n_trials), np.bool_) if pool is None else pool.wanted(state.genomes)
                for pool, state in zip(pools, states, strict=True)
            ]
        )
        values = np.full(wanted.shape, np.nan)
        genomes = np.stack([state.genomes for state in states])
        is_open = np.ones(wanted.shape[:2], np.bool_)
        # the order inside a round changes nothing in a simulation without drift; it is the evaluator's all the same
        order = rounds(population, task.n_trials, trial_by_trial=racing, shuffle=False, root_seed=0, generation=number)
        for done, places in enumerate(order, 1):
            asked = np.zeros_like(wanted)
            asked[:, places[:, 0], places[:, 1]] = True
            run_, individual, trial = np.nonzero(asked & wanted & is_open[:, :, None])
            if len(run_):
                key = keys(np.array(seeds, np.uint64)[run_], Purpose.TRIAL, number, individual, trial, 0)
                results = run_trials(config, robot, genomes, run_, individual, trial, key)
                fitness = task.fitness(results)
                values[run_, individual, trial] = fitness
                np.add.at(spent, run_, results.durations_s)
                for r, i, t, value in zip(run_, individual, trial, fitness.tolist(), strict=True):
                    pool = pools[r]
                    if pool is not None:
                        pool.add(genomes[r, i].tobytes(), int(t), value, False)
            if racing:
                for r in range(RUNS):
                    known = _known(pools[r], genomes[r], values[r])
                    known[:, done:] = np.nan
                    is_open[r] &= still_open(known, task.worst_fitness, task.best_fitness, saving.racing)
        fitness_of = np.empty((RUNS, population))
        for r in range(RUNS):
            known = _known(pools[r], genomes[r], values[r])
            fitness_of[r] = raced_fitness(known, task.worst_fitness, task.best_fitness, saving.racing)
        robot_s.append(spent.copy())
        tested.append(_tested(config, robot, genomes[np.arange(RUNS), fitness_of.argmax(axis=1)], number))
        if number < config.algorithm.generations:
            states = [
                algorithm.tell(state, fitness, generator(seed, Purpose.ALGORITHM, number + 1))
                for state, fitness, seed in zip(states, fitness_of, seeds, strict=True)
            ]
    return Outcome(np.stack(robot_s, axis=1), np.stack(tested, axis=1))


def _known(pool: Pool | None, genomes: NDArray[np.uint8], values: NDArray[np.float64]) -> NDArray[np.float64]:
    return values.copy() if pool is None else pool.means(genomes)[0]


def _tested(config: ExperimentConfig, robot: Robot, best: NDArray[np.uint8], generation: int) -> NDArray[np.float64]:
    """Fitness of each run's best on fresh trials, shape ``(r,)``."""
    task = config.build_task()
    n_fresh = 1 if robot.spec.noise_free else FRESH
    run, fresh, trial = (a.ravel() for a in np.indices((RUNS, n_fresh, task.n_trials)))
    key = keys(7, Purpose.REPEAT, generation, run, fresh, trial)
    results = run_trials(config, robot, best[:, None], run, np.zeros_like(run), trial, key)
    return task.fitness(results).reshape(RUNS, -1).mean(axis=1)

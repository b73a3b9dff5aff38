"""Transfer to robots that its simulations do not contain, against what else one could do with as many trials.

Robots are simulated bodies in which something differs that no simulated robot of the ensemble varies, with a gap that
they keep for life: wheel base, sensor cones, sensor range and motion noise (goal reach); the opening of the infrared
sensors, where obstacles and lamps stand, and the top speed (bodies with walls). No setting was chosen on these seeds.
Fitness is always that of fresh trials. The pole is balanced with constant sensor offsets, with which no controller of
this size stands.

    .venv/bin/python tools/bench/transfer.py [ROW ...] --figure docs/images/transfer-regret.png
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(1, str(Path(__file__).parents[2]))

from figures import Figure
from transfer_methods import LOOKED_AT, TRIALS, Robot, genetic, in_turn, robot_of, thompson, transfer

from sceann_hil.config import ExperimentConfig, load_config, parse_config
from sceann_hil.run.transfer.algorithm import Transfer
from sceann_hil.run.transfer.preparation import Preparation
from sceann_hil.run.transfer.state import Verdict

ROOT = Path(__file__).parents[2]
ROBOTS = 30
POLES = 12
MARKS = (0, 4, 8, 12, 16, 24, 32, 40)
TRANSFER = {"type": "transfer", "least_gain": 0.0}
GAP_ONLY = {"radius_m": 0.0275, "sensor_half_width_deg": 15.0, "sensor_reference_m": 0.05, "motion_noise": 0.1}
GOAL = """
task: {type: goal_reach}
robot: {type: diffdrive}
controller: {coding: sceann3, n_hidden: 2}
algorithm: {type: transfer, least_gain: 0.0}
"""
POLE = """
task: {type: pole_balancing}
robot: {type: cartpole}
controller: {coding: sceann3, n_hidden: 3}
algorithm: {type: transfer, trials: 20}
"""


@dataclass(frozen=True)
class Row:
    """One kind of robot.

    Attributes:
        name: for people.
        config: of the transfer, its ensemble included.
        robot: the section of one robot, from its own random numbers.
        first_seed: of the robots; nothing was chosen on these.
        population: of the GA, so that it does 10,200 trials.
        equal_by: trials within which it shall equal the GA; None if that is only reported.
        better_by: by how much its fitness shall be above the GA's after all trials, with an interval above 0; 0 for
            not worse: the interval is above -5 % of the GA's fitness.
        robots: how many.
        ga_runs: of the GA on each.
    """

    name: str
    config: ExperimentConfig
    robot: Callable[[np.random.Generator], dict[str, Any]]
    first_seed: int
    population: int = 25
    equal_by: int | None = None
    better_by: float = 0.0
    robots: int = ROBOTS
    ga_runs: int = 3


def goal_robot(r: np.random.Generator) -> dict[str, Any]:
    """A two-wheeled robot that the ensemble does not contain, as in the first experiments with the method."""
    return {
        "type": "diffdrive",
        "radius_m": 0.0275 * r.uniform(0.85, 1.2),
        "sensor_half_width_deg": 15.0 * r.uniform(0.7, 1.4),
        "sensor_reference_m": 0.05 * r.uniform(0.6, 1.5),
        "motion_noise": r.uniform(0.05, 0.2),
        "gap": _gap(r, 7),
    }


def in_a_world(robot: dict[str, Any], r: np.random.Generator) -> dict[str, Any]:
    """A body with walls: the world is not quite as it was measured, and infrared sensors have an opening."""
    data = {**robot, "world": dict(robot["world"])}
    world = data["world"]
    for things in ("obstacles", "lamps"):
        world[things] = [
            {**one, "at_m": [float(x + r.uniform(-0.03, 0.03)) for x in one["at_m"]]} for one in world[things]
        ]
    opening, reach = float(r.uniform(5.0, 15.0)), float(r.uniform(0.7, 1.4))
    for sensors in ("infrared", "light"):
        world[sensors] = [
            {**one, "direction_deg": one["direction_deg"] + float(r.uniform(-5.0, 5.0))} for one in world[sensors]
        ]
    world["infrared"] = [
        {**one, "range_m": one["range_m"] * reach, "half_width_deg": opening, "rays": 3} for one in world["infrared"]
    ]
    world["lamps"] = [{**one, "reference_m": one["reference_m"] * float(r.uniform(0.6, 1.5))} for one in world["lamps"]]
    world["wheel_interval_m"] = 2.0 * data["radius_m"] * float(r.uniform(0.85, 1.2))
    data["top_speed_m_s"] = data["top_speed_m_s"] * float(r.uniform(0.9, 1.1))
    data["motion_noise"] = float(r.uniform(0.05, 0.2))
    data["gap"] = _gap(r, len(world["infrared"]) + len(world["ground"]) + len(world["light"]))
    return data


def mujoco_cart(robot: dict[str, Any], r: np.random.Generator) -> dict[str, Any]:
    """MuJoCo's cart, whose sensors and motor are not quite as they should be."""
    sensors = []
    for one in robot["sensors"]:
        span = (one["at_1"] - one["at_0"]) / r.normal(1.0, 0.02)
        at_0 = one["at_0"] - r.normal(0.0, 0.005) * span
        sensors.append({**one, "at_0": float(at_0), "at_1": float(at_0 + span)})
    force = 3.0 * float(r.uniform(0.7, 1.0))
    return {**robot, "sensors": sensors, "motors": [{"at_0": -force, "at_1": force}]}


def _gap(r: np.random.Generator, n_sensors: int) -> dict[str, Any]:
    return {
        "sensor_offset": r.normal(0.0, 0.01, n_sensors).tolist(),
        "sensor_gain": r.normal(1.0, 0.1, n_sensors).tolist(),
        "sensor_noise": 0.01,
        "motor_gain": r.uniform(0.6, 1.2, 2).tolist(),
        "motor_dead_band": r.uniform(0.0, 0.2),
        "latency_steps": float(r.integers(0, 3)),
    }


def pole_robot(config: ExperimentConfig, number: int) -> Robot:
    """A cart with constant sensor offsets of about half a percent."""
    seed = 501_000 + number
    r = np.random.default_rng(seed)
    offset = (np.array([1, 1]) - 2 * r.integers(0, 2, 2)) * r.uniform(0.0005, 0.01, 2)
    return robot_of(config, {"type": "cartpole", "gap": {"sensor_offset": offset.tolist()}}, seed)


# -- figures ------------------------------------------------------------------------------------------------------


def rows() -> dict[str, Callable[[Path | None], list[Figure]]]:
    """What is measured, by name."""
    goal = parse_config(GOAL, "bench")
    gap_only = goal.with_changes({"uncertainty": {"keys": GAP_ONLY}})
    found: dict[str, Callable[[Path | None], list[Figure]]] = {
        "goal": lambda figure: _row(
            Row("gap and body outside the ensemble", gap_only, goal_robot, 500_000, 25, 16, 0.03), figure
        ),
        "pole": lambda _: _pole(),
        "usual": lambda _: _row(Row("usual ensemble", goal, goal_robot, 500_000), None),
    }
    for place, task in enumerate(("avoidance", "phototaxis")):
        row = _with_walls(task, 502_000 + 1000 * place)
        found[task] = lambda _, row=row: _row(row, None)  # type: ignore[misc]  # a default that is bound here
    found["cart"] = lambda _: _row(_cart(), None)
    return found


def _cart() -> Row:
    config = load_config(ROOT / "configs" / "gymnasium" / "transfer_to_mujoco.yaml")
    body = config.robot.model_dump(mode="json")
    return Row("MuJoCo's cart", config, lambda r: mujoco_cart(body, r), 504_000, 50, robots=10, ga_runs=1)


def _with_walls(task: str, first_seed: int) -> Row:
    shipped = load_config(ROOT / "configs" / "tasks" / f"{task}.yaml")
    config = shipped.with_changes({"algorithm": TRANSFER})
    body = shipped.robot.model_dump(mode="json")
    return Row(f"{task}, walls", config, lambda r: in_a_world(body, r), first_seed, 50, 24, ga_runs=1)


def run(figure: Path | None = None) -> list[Figure]:
    """All rows."""
    return list(figures(figure))


def figures(figure: Path | None = None, only: tuple[str, ...] = ()) -> Iterator[Figure]:
    """The same, one after the other."""
    for name, measure in rows().items():
        if not only or name in only:
            yield from measure(figure)


def _row(row: Row, figure: Path | None) -> list[Figure]:
    config, name = row.config, row.name
    preparation = Preparation(config, (), 100, 1500)
    began, cpu = time.perf_counter(), time.process_time()
    algorithm = Transfer(config.genome_length, TRIALS, 1, None, 0.0, preparation)
    state = algorithm.start(np.random.default_rng(0))
    took, cpu_s = time.perf_counter() - began, time.process_time() - cpu
    ensemble = preparation.prepared(state.candidates).ensemble
    mean = ensemble.mean.mean(axis=1)
    variance = np.maximum(ensemble.fitness.mean(axis=2).var(axis=0).astype(np.float64), 1e-4)
    robots, seconds = [], []
    for number in range(row.robots):
        seed = row.first_seed + number
        robot = robot_of(config, row.robot(np.random.default_rng(seed)), seed)
        seconds += transfer(robot, algorithm, TRIALS)[2]
        thompson(robot, state.candidates, (mean, variance, ensemble.spread))
        in_turn(robot, state.candidates, mean)
        length = config.genome_length
        scratch = [genetic(robot, length, None, seed * 10 + i, row.population) for i in range(row.ga_runs)]
        robot.curves["GA"] = np.mean(scratch, axis=0).tolist()
        best = state.candidates[np.argsort(-mean)[: row.population]]
        robot.curves["evolve --from"] = genetic(robot, length, best, seed * 10 + 9, row.population)
        robots.append(robot)
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    if figure is not None:
        _draw(robots, figure)
    goal = np.array([robot.curves["GA"][-1] for robot in robots])
    return [
        Figure(f"{name}: preparation", f"{took:.0f} s, {cpu_s:.0f} s of CPU (0 if it was in the cache)", "< 180 s"),
        Figure(f"{name}: GA after 10,200 trials on the robot", f"{goal.mean():.3f} ({row.robots} robots)"),
        *_compared(row, robots, goal),
        Figure(
            f"{name}: one decision",
            f"{np.median(seconds) * 1e3:.0f} ms, slowest {max(seconds) * 1e3:.0f} ms",
            "< 200 ms",
            float(np.median(seconds)) < 0.2,
        ),
        Figure(f"{name}: memory", f"{peak_gb:.2f} GB", "< 1.5 GB", peak_gb < 1.5),
    ]


def _compared(row: Row, robots: list[Robot], goal: NDArray[np.float64]) -> Iterator[Figure]:
    """Every method against the GA on the same robots."""
    for method in ("transfer", "Thompson sampling, no model", "20 best of simulation in turn"):
        curve = np.array([robot.curves[method] for robot in robots])
        ours = method == "transfer" and row.equal_by is not None
        for mark in (16, 24, 40):
            promised, kept = "", None
            difference, half = _interval(curve[:, mark] - goal)
            if ours and mark == TRIALS and row.better_by:
                promised = f">= {row.better_by}, lower end > 0"
                kept = difference >= row.better_by and difference - half > 0.0
            elif ours and mark == TRIALS:
                least = -0.05 * float(goal.mean())
                promised, kept = f"not worse: lower end > {least:.3f}", difference - half > least
            measured = f"{curve[:, mark].mean():.3f}; to GA {difference:+.3f} [{difference - half:+.3f}, "
            yield Figure(f"{row.name}: {method}, {mark} trials", f"{measured}{difference + half:+.3f}]", promised, kept)
        if method == "transfer":
            equal = next((n for n in range(TRIALS + 1) if curve[:, n:].mean(axis=0).min() >= goal.mean()), None)
            yield Figure(
                f"{row.name}: trials to equal the GA's 10,200 from then on",
                f"{equal}; fitness after {MARKS} trials: {curve.mean(axis=0)[list(MARKS)].round(3).tolist()}",
                f"<= {row.equal_by}" if row.equal_by is not None else "",
                (equal is not None and equal <= row.equal_by) if row.equal_by is not None else None,
            )
    from_first = np.array([robot.curves["evolve --from"] for robot in robots])
    n_trials = robots[0].evaluator.task.n_trials
    for generation, place in ((0, 0), (1, 1), (10, 4), (50, 8)):
        difference, half = _interval(from_first[:, place] - goal)
        yield Figure(
            f"{row.name}: evolve --from, {(generation + 1) * row.population * n_trials} trials",
            f"{from_first[:, place].mean():.3f}; to GA {difference:+.3f} [{difference - half:+.3f}, "
            f"{difference + half:+.3f}]",
        )


def _pole() -> list[Figure]:
    config = parse_config(POLE, "bench")
    preparation = Preparation(config, (), 100, 1500)
    algorithm = Transfer(config.genome_length, 20, 1, None, 0.001, preparation)
    said, trials, stood = 0, [], []
    for number in range(POLES):
        robot = pole_robot(config, number)
        verdict, n, _ = transfer(robot, algorithm, 20)
        said += verdict is Verdict.NONE_SUCCEEDS
        trials.append(n)
        stood.append(max(robot.curves["transfer"]))
    return [
        Figure(
            "pole balancing with constant offsets: says that no candidate stands",
            f"{said} of {POLES} robots, after {min(trials)} to {max(trials)} trials (best true fitness of what was "
            f"recommended: {max(stood):.0f} of 3000 steps)",
            f"{POLES} of {POLES} within 20 trials",
            said == POLES and max(trials) <= 20,
        )
    ]


def _interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """Mean and half of its 95 % interval."""
    from scipy.stats import t

    half = t.ppf(0.975, len(values) - 1) * values.std(ddof=1) / np.sqrt(len(values))
    return float(values.mean()), float(half)


def _draw(robots: list[Robot], path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(8, 4.5), layout="constrained")
    goal = np.array([robot.curves["GA"][-1] for robot in robots])
    generations = np.array(LOOKED_AT)
    colours = iter(("#0072b2", "#e69f00", "#cc79a7", "#555555", "#009e73"))
    for method in ("transfer", "Thompson sampling, no model", "20 best of simulation in turn", "GA", "evolve --from"):
        curve = goal[:, None] - np.array([robot.curves[method] for robot in robots])
        trials = (generations + 1) * 200 if method in ("GA", "evolve --from") else np.arange(TRIALS + 1) + 1
        middle = curve.mean(axis=0)
        half = 1.96 * curve.std(axis=0, ddof=1) / np.sqrt(len(robots))
        colour = next(colours)
        axes.plot(trials, middle, color=colour, label=method)
        axes.fill_between(trials, middle - half, middle + half, color=colour, alpha=0.2, linewidth=0)
    axes.axhline(0.0, color="black", linewidth=0.8)
    axes.set_xscale("log")
    axes.set_xlabel("trials on the robot (+ 1)")
    axes.set_ylabel("regret: fitness of the GA after 10,200 trials\nminus that of what is recommended")
    axes.legend(frameon=False)
    axes.set_title(f"{len(robots)} robots that the ensemble does not contain (mean, 95 %)", fontsize=10)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", nargs="*", metavar="ROW", help=f"of: {', '.join(rows())}; default: all")
    parser.add_argument("--figure", type=Path)
    arguments = parser.parse_args()
    if unknown := set(arguments.rows) - set(rows()):
        parser.error(f"unknown: {', '.join(sorted(unknown))}")
    for one in figures(arguments.figure, tuple(arguments.rows)):
        mark = "" if one.kept is None else "kept" if one.kept else "NOT KEPT"
        print(f"{one.name}: {one.measured}  {one.promised}  {mark}", flush=True)

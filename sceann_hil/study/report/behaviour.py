"""Fig. 7 and Fig. 11: what the best controllers do, traced again from the seeds of their runs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from sceann_hil.config import ExperimentConfig
from sceann_hil.network.coding import Bits
from sceann_hil.robot import EndReason, Results
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.seeds import Purpose, keys
from sceann_hil.study.report.cells import Cell
from sceann_hil.study.scene import draw_others, draw_part, draw_surroundings
from sceann_hil.study.style import BLUE, DARK, GREEN, GREY, LIGHT, RED, drawing, plain, save


@dataclass(frozen=True)
class Champion:
    """One controller and its trials.

    Attributes:
        config: the experiment that it comes from.
        genome: bits, shape ``(L,)``.
        run: number of its run.
        fitness: in the last generation of its run.
        results: of all its trials, with traces.
    """

    config: ExperimentConfig
    genome: Bits
    run: int
    fitness: float
    results: Results


def best_champion(cell: Cell) -> Champion:
    """The fittest champion of a condition; among equals the one that moves least, then the one of the first run.

    Its trials are traced with the noise of generation 0 of its run's seed tree.
    """
    best = np.flatnonzero(cell.fitness == cell.fitness.max())
    traced = [_traced(cell, int(place)) for place in best[:50]]
    return min(traced, key=lambda champion: (_travel(champion.results), champion.run))


def _traced(cell: Cell, place: int) -> Champion:
    config, genome = cell.condition.config, cell.genome(place)
    with config.robot.build() as robot:
        batch = BatchEvaluator.of(config, robot)
        noise = keys(int(cell.runs.seeds[place]), Purpose.TRIAL, 0, 0, np.arange(batch.task.n_trials), 0)
        results = batch.trace(genome[None], noise)
    return Champion(config, genome, int(cell.runs.numbers[place]), float(cell.fitness[place]), results)


def _travel(results: Results) -> float:
    """Farthest from where it began, over all trials."""
    return max(float(np.abs(trace.state[:, 0] - trace.state[0, 0]).max()) for trace in results.traces or ())


def straightness(path: NDArray[np.float32], top_speed_step_m: float) -> float:
    """Length of a path divided by the distance between its ends, after the first turn.

    The turn is over when the heading has come within 20 degrees of the final direction for the first time.
    """
    direction = np.arctan2(*(path[-1, [1, 0]] - path[0, [1, 0]]))
    off = np.abs((path[:, 2] - direction + np.pi) % (2.0 * np.pi) - np.pi)
    begin = int(np.argmax(off < np.deg2rad(20.0)))
    leg = path[begin:, :2]
    chord = float(np.linalg.norm(leg[-1] - leg[0]))
    return float(np.linalg.norm(np.diff(leg, axis=0), axis=1).sum()) / max(chord, top_speed_step_m)


def draw_fig7(champion: Champion, shown: int, path: Path) -> None:
    """Trajectories in the arena, the trial number `shown` on top."""
    robot = champion.config.robot.build()
    scene = robot.drawing
    if scene is None or not scene.from_above:
        raise ValueError(f"robot: expected one that is drawn from above, got {champion.config.robot.type}")
    left, right, bottom, top = scene.bounds_m
    with drawing(11.5, 10.5) as figure:
        axes = figure.subplots()
        plain(axes)
        draw_surroundings(axes, scene)
        for number, trace in enumerate(champion.results.traces or ()):
            x, y = trace.state[:, 0], trace.state[:, 1]
            if number == shown:
                axes.plot(x, y, color=BLUE, linewidth=1.8, zorder=3, label=f"trial {number + 1}")
                for step in range(0, len(x), 5):
                    state = dict(zip(robot.spec.state_fields, trace.state[step].tolist(), strict=True))
                    draw_part(axes, scene.parts[0], state, 0.9 if step == 0 else 0.45)
                    if step == 0:
                        draw_others(axes, scene, state)
            else:
                label = "the other initial headings" if number == (shown == 0) else None
                axes.plot(x, y, color=GREY, linewidth=0.9, alpha=0.8, zorder=2, label=label)
        bar = left + 0.1 * (right - left)
        axes.plot([bar, bar + 0.1], [top - 0.08 * (top - bottom)] * 2, color=DARK, linewidth=1.4)
        axes.text(bar + 0.05, top - 0.09 * (top - bottom), "0.1 m", ha="center", va="top", fontsize=8)
        figure.legend(loc="outside lower center", ncols=2)
        save(figure, path)


def draw_fig11(champion: Champion, path: Path) -> None:
    """Cart and pole over time, with the limits at which a trial ends."""
    trace = (champion.results.traces or ())[0]
    time_s = np.arange(len(trace.state)) * champion.config.robot.spec.tick_s
    with drawing(17.0, 10.0) as figure:
        upper, lower = figure.subplots(2, 1, sharex=True)
        _over_time(upper, time_s, trace.state[:, 0], BLUE, "cart position (m)", "2.4 m")
        _over_time(lower, time_s, np.rad2deg(trace.state[:, 2]), GREEN, "pole angle (degrees)", "36 degrees")
        lower.set_xlabel("time (s)")
        lower.set_xlim(0.0, float(time_s[-1]))
        save(figure, path)


def _over_time(axes: Axes, time_s: NDArray[Any], values: NDArray[Any], colour: str, label: str, limit: str) -> None:
    axes.axhline(0.0, color=LIGHT, linewidth=1.0)
    axes.plot(time_s, values, color=colour, linewidth=0.9)
    reach = 1.25 * float(np.abs(values).max())
    axes.set_ylim(-reach, reach)
    axes.set_ylabel(label)
    extreme = float(np.abs(values).max())
    axes.text(
        0.995,
        0.97,
        f"largest {extreme:.2f}, limit {limit}",
        transform=axes.transAxes,
        ha="right",
        va="top",
        color=RED,
        fontsize=8,
    )


def swings(champion: Champion) -> tuple[float, float, bool]:
    """Largest cart displacement (m), largest pole angle (degrees), and whether it lasted to the end."""
    trace = (champion.results.traces or ())[0]
    lasted = champion.results.end_reasons[0] == EndReason.TIME_UP
    angle_deg = float(np.rad2deg(np.abs(trace.state[:, 2]).max()))
    return float(np.abs(trace.state[:, 0]).max()), angle_deg, bool(lasted)

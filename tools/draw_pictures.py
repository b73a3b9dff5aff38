#!/usr/bin/env python3
"""The pictures of docs/first-robot.md and docs/course, from configs/uno.yaml and runs of it:

.venv/bin/python tools/draw_pictures.py
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle, Rectangle, Wedge

import sceann_hil as sh

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "configs" / "uno.yaml"
COURSE = ROOT / "docs" / "course" / "images"
BLUE, ORANGE, GREY, RED, GREEN = "#1565c0", "#e65100", "#607d8b", "#b71c1c", "#1b5e20"
SENSOR_COLOURS = ("#1b5e20", "#0d47a1", "#b71c1c", "#6a1b9a", "#e65100")
"""As the wires in firmware/wiring.svg: sensor 0, the one furthest to the right, first."""


def main() -> None:
    """Draw them all."""
    plt.rcParams.update({"font.size": 10, "axes.spines.top": False, "axes.spines.right": False})
    config = sh.config(CONFIG)
    robot_from_above(config)
    with tempfile.TemporaryDirectory() as folder:
        run = sh.evolve(config, Path(folder) / "run")
        evolution(config, run)
        network(config, run)
        reality(config, run)
    formulas(config)


def save(figure: Any, path: Path) -> None:
    """As PNG."""
    figure.savefig(path, dpi=130, bbox_inches="tight")
    plt.close(figure)


def robot_from_above(config: sh.ExperimentConfig) -> None:
    """Where everything sits, and the arena with its starts."""
    body: Any = config.robot
    radius_m, arena_m = body.radius_m, body.arena_m
    figure, (above, arena) = plt.subplots(1, 2, figsize=(11, 4.6), gridspec_kw={"width_ratios": [1, 1.25]})
    # the nose points up, so x of the robot is up and y is to the left
    above.add_patch(Circle((0, 0), 100 * radius_m, facecolor="#e3f2fd", edgecolor="black"))
    for side, colour, name in ((-1, BLUE, "left wheel\nmotor 0"), (1, RED, "right wheel\nmotor 1")):
        above.add_patch(Rectangle((side * 100 * radius_m - 1.3, -3.2), 2.6, 6.4, facecolor=colour))
        above.text(
            side * (100 * radius_m + 2.2), 0, name, ha="left" if side > 0 else "right", va="center", color=colour
        )
    for number, (sensor, colour) in enumerate(zip(body.world.infrared, SENSOR_COLOURS, strict=True)):
        ahead, left = (100 * value for value in sensor.at_m)
        angle = np.deg2rad(sensor.direction_deg)
        tip = np.array([-np.sin(angle), np.cos(angle)])
        above.plot([-left, -left + 12 * tip[0]], [ahead, ahead + 12 * tip[1]], color=colour, lw=1, ls="--")
        above.plot([-left], [ahead], "s", color=colour, ms=9)
        above.text(
            -left + 13.3 * tip[0],
            ahead + 13.3 * tip[1],
            f"{number}",
            color=colour,
            ha="center",
            va="center",
            weight="bold",
        )
    front = Wedge((0, 0), 100 * radius_m + 1.0, 50, 130, width=0.8, facecolor=ORANGE)
    above.add_patch(front)
    above.annotate("bumper", (-6.6, 6.9), (-16.5, 4.6), color=ORANGE, arrowprops={"arrowstyle": "-", "color": ORANGE})
    above.annotate("", (0.0, 4.5), (0.0, 8.5), arrowprops={"arrowstyle": "<->", "color": "black"})
    above.text(0.5, 6.0, "4 cm", fontsize=9)
    above.text(0, -5.5, "Arduino, shield,\nbatteries, main switch", ha="center", va="center", fontsize=9)
    above.text(0, -11.5, f"seen from above, forwards is up; {200 * radius_m:g} cm across", ha="center", color=GREY)
    above.set(xlim=(-17, 17), ylim=(-13, 19), aspect="equal", title="The robot")
    above.axis("off")
    arena.add_patch(Rectangle((0, 0), *arena_m, fill=False, lw=4, ec=GREY))
    for number, start in enumerate(config.build_task().starts):
        x, y, heading = start
        arena.add_patch(Circle((x, y), radius_m, facecolor="#ffe0b2", edgecolor="black"))
        arena.plot([x, x + radius_m * np.cos(heading)], [y, y + radius_m * np.sin(heading)], color="black", lw=2)
        arena.text(x + 0.11, y + 0.02, f"start {number}", fontsize=9)
    arena.set(
        xlim=(-0.05, arena_m[0] + 0.05), ylim=(-0.05, arena_m[1] + 0.05), aspect="equal", title="The arena, metres"
    )
    arena.spines[:].set_visible(False)
    save(figure, ROOT / "docs" / "images" / "first_robot.png")


def paths(axes: Any, config: sh.ExperimentConfig, trials: Any, title: str) -> None:
    """Where a controller drove from every start."""
    body: Any = config.robot
    axes.add_patch(Rectangle((0, 0), *body.arena_m, fill=False, lw=3, ec=GREY))
    for trial, colour in zip(trials, (BLUE, ORANGE, GREEN, RED), strict=False):
        frame = trial.frame()
        axes.plot(frame["x_m"], frame["y_m"], color=colour, lw=1.4)
        axes.plot(frame["x_m"].iloc[0], frame["y_m"].iloc[0], "o", color=colour, ms=5)
        if trial.end_reason is sh.EndReason.OUT_OF_BOUNDS:
            axes.plot(frame["x_m"].iloc[-1], frame["y_m"].iloc[-1], "x", color=colour, ms=9, mew=2)
    axes.set(xlim=(-0.03, body.arena_m[0] + 0.03), ylim=(-0.03, body.arena_m[1] + 0.03), aspect="equal", title=title)
    axes.set(xticks=[], yticks=[])
    axes.spines[:].set_visible(False)


def evolution(config: sh.ExperimentConfig, run: sh.Run) -> None:
    """Worksheet 1: the best of three generations, and fitness over all."""
    figure = plt.figure(figsize=(11, 5.6))
    table, people = run.generations(), run.individuals()
    for place, number in enumerate((0, 10, 50)):
        best = people[people["generation"] == number].sort_values("fitness").iloc[-1]
        axes = figure.add_subplot(2, 3, place + 1)
        trials = run.simulate(run.individual(int(best.name if "id" not in people else best["id"])))
        paths(axes, config, trials, f"best of generation {number}: fitness {best['fitness']:.2f}")
    axes = figure.add_subplot(2, 1, 2)
    axes.plot(table["best_fitness"], color=BLUE, label="best")
    axes.plot(table["mean_fitness"], color=ORANGE, label="mean of all 25")
    axes.set(xlabel="generation", ylabel="fitness", ylim=(0, 0.5))
    axes.legend(frameon=False)
    figure.tight_layout()
    save(figure, COURSE / "evolution.png")


def network(config: sh.ExperimentConfig, run: sh.Run) -> None:
    """Worksheet 2: the champion's network, and what it does in one trial."""
    best = run.champion()
    weights = best.weights
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), gridspec_kw={"width_ratios": [1, 1.3]})
    left.imshow(weights.to_numpy(), cmap="RdBu", vmin=-1, vmax=1)
    left.set_xticks(range(weights.shape[1]), weights.columns)
    left.set_yticks(range(weights.shape[0]), weights.index)
    left.set(xlabel="listens to", title="Connections: +1 blue, -1 red")
    left.spines[:].set_visible(False)
    left.grid(False)
    frame = run.simulate(best)[0].frame()
    for name, colour in zip(("s1", "s3", "s5"), SENSOR_COLOURS[::2], strict=True):
        right.plot(frame["time_s"], frame[name], color=colour, lw=1, label=name)
    right.plot(frame["time_s"], frame["m1"], color="black", lw=1.4, label="m1 (left wheel)")
    right.plot(frame["time_s"], frame["m2"], color="black", lw=1.4, ls=":", label="m2 (right wheel)")
    right.set(xlabel="seconds", title="One trial", ylim=(-0.02, 1.05))
    right.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    figure.tight_layout()
    save(figure, COURSE / "network.png")


def reality(config: sh.ExperimentConfig, run: sh.Run) -> None:
    """Worksheet 3: evolved for an ideal robot, and for robots of all kinds; tried on an ideal one and on a weak one."""
    ideal = config.with_changes({"robot.gap": {}, "seed": 8})
    with tempfile.TemporaryDirectory() as folder:
        champion = sh.evolve(ideal, Path(folder) / "ideal").champion()
    weak = {"motor_gain": [0.7, 1.0], "sensor_gain": 0.85, "sensor_noise": 0.02, "latency_steps": 2}
    figure, axes = plt.subplots(1, 4, figsize=(13, 2.7))
    for column, (name, one) in enumerate(
        (("evolved on an ideal robot", champion), ("evolved on many robots", run.champion()))
    ):
        for row, (where, gap) in enumerate((("ideal robot", {}), ("a weak left wheel, a lag", weak))):
            trials = sh.simulate(config, one, gap=gap)
            mean = np.mean([trial.fitness for trial in trials])
            paths(axes[2 * column + row], config, trials, f"{name}\non: {where}: {mean:.2f}")
            axes[2 * column + row].title.set_fontsize(9)
    figure.tight_layout()
    save(figure, COURSE / "reality.png")


FORMULAS = {
    "drive fast": "speed",
    "do not hit anything": "1 - nearest",
    "both, and straight": "speed * (1 - sqrt(abs(left - right))) * (1 - nearest)",
}


def formulas(config: sh.ExperimentConfig) -> None:
    """Worksheet 4: what is asked for is what comes."""
    figure, axes = plt.subplots(1, 3, figsize=(11, 3.1))
    for axis, (name, step) in zip(axes, FORMULAS.items(), strict=True):
        kept = {key: getattr(config.task, key) for key in ("max_steps", "starts", "forwards_only", "whole_trials")}
        own = sh.config(CONFIG, task={"type": "formula", "step": step, **kept})
        with tempfile.TemporaryDirectory() as folder:
            run = sh.evolve(own, Path(folder) / "run")
            paths(axis, own, run.simulate(run.champion()), f"{name}\n{step}")
        axis.title.set_fontsize(9)
    figure.tight_layout()
    save(figure, COURSE / "formulas.png")


if __name__ == "__main__":
    main()

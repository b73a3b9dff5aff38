"""Measuring on a robot for a report: shown while it goes on, and every trial written down as soon as it is over."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import typer
from rich.console import Console

from sceann_hil.commands.progress import show_trials
from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ExitCode, as_user_error
from sceann_hil.network.coding import Bits
from sceann_hil.robot import RobotError
from sceann_hil.study.gap import Measured, Measurement, measure
from sceann_hil.supervision.operators.staff import beside
from sceann_hil.supervision.stopping import Stopped

TRIALS_NAME = "trials.csv"
_COLUMNS = ("begun_at", "robot", "genome", "repeat", "trial", "fitness", "steps", "end_reason", "robot_s")


def measured(
    config: ExperimentConfig, genomes: Bits, names: list[str], repeats: int, folder: Path
) -> tuple[Measurement, dict[str, Any]]:
    """Run every genome `repeats` times on the configuration's robot.

    Args:
        config: of the run.
        genomes: bits, shape ``(g, L)``.
        names: of the genomes, in hexadecimal.
        repeats: how often each runs all its trials.
        folder: where `TRIALS_NAME` gets a row per trial, after those of earlier measurements.

    Returns:
        The measurement, and the link's timing where there is a link.
    """
    console = Console(stderr=True, highlight=False)
    robot, task = config.robot.build(), config.task.build()
    n_trials = len(genomes) * repeats * task.n_trials
    show = partial(console.print, markup=False, soft_wrap=True)
    with (
        _written_down(folder / TRIALS_NAME, robot.spec.name, names) as write,
        _explained(console, folder / TRIALS_NAME),
        robot,
        show_trials(console, robot.spec.name, n_trials) as progress,
        beside(robot, config.operator, show) as desk,
    ):

        def report(trial: Measured) -> None:
            write(trial)
            progress(trial)

        measurement = measure(robot, config.phenotype, task, genomes, repeats, config.seed, desk, report)
        return measurement, robot.timing


@contextmanager
def _written_down(path: Path, robot: str, names: list[str]) -> Iterator[Callable[[Measured], None]]:
    begun_at = datetime.now(UTC).isoformat(timespec="milliseconds")
    with path.open("a", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        if file.tell() == 0:
            rows.writerow(_COLUMNS)

        def write(trial: Measured) -> None:
            what = (names[trial.genome], trial.repeat, trial.trial, trial.fitness, trial.steps)
            rows.writerow((begun_at, robot, *what, trial.end_reason, trial.robot_s))
            file.flush()

        yield write


@contextmanager
def _explained(console: Console, path: Path) -> Iterator[None]:
    """A measurement has no `sceann resume`: whatever ends it early says where its trials are."""
    kept = f"What was measured until then is in {path}."
    try:
        yield
    except Stopped as stopped:
        console.print(f"Stopped: {stopped.message}. {kept}", soft_wrap=True)
        raise typer.Exit(ExitCode.OPERATOR_FINISHED) from None
    except KeyboardInterrupt:
        console.print(f"Stopped, as asked. {kept}", soft_wrap=True)
        raise typer.Exit(ExitCode.INTERRUPTED_NOW) from None
    except RobotError as error:
        told = as_user_error(error)
        if told is None:
            raise
        raise type(told)(told.message, f"Put that right, then give the same command again. {kept}") from error

"""Measuring for a report: on a robot with everything that holds whenever one moves, or in simulation at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import typer
from rich.console import Console

from sceann_hil.commands.ending import EXIT_CODES
from sceann_hil.commands.progress import show_trials
from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError, as_user_error
from sceann_hil.network.coding import Bits, genome_to_hex
from sceann_hil.robot import RobotError
from sceann_hil.run.experiment import Experiment
from sceann_hil.run.measuring import Measurement, measuring, simulate
from sceann_hil.run.session import Presence
from sceann_hil.supervision.operators.staff import staffed_desk
from sceann_hil.supervision.signals import Signals
from sceann_hil.supervision.stopping import Stopped


def measure(
    directory: Path, config: ExperimentConfig, kind: str, genomes: Bits, repeats: int, more: dict[str, float]
) -> tuple[Measurement, dict[str, Any]]:
    """Run every genome `repeats` times on the configuration's robot.

    Args:
        directory: the run, whose journal keeps what a robot did; a simulated one just does it again.
        config: of the run, with the robot that is asked.
        kind: what for, in a word.
        genomes: different ones, bits, shape ``(g, L)``.
        repeats: how often each runs all its trials.
        more: what may be spent on top of what is spent.

    Returns:
        The measurement, and the link's timing where there is a link.
    """
    console = Console(stderr=True, highlight=False)
    robot = config.robot.build()
    n_trials = len(genomes) * repeats * config.build_task().n_trials
    if robot.spec.deterministic:
        must_be_computable(config)
        with robot, show_trials(console, robot.spec.name, n_trials) as report:
            task = config.build_task()
            return simulate(robot, config.phenotype, task, genomes, repeats, config.seed, report), {}
    show = partial(console.print, markup=False, soft_wrap=True)
    signals = Signals(show)
    plan = {"genomes": [genome_to_hex(bits) for bits in genomes], "repeats": repeats}
    with (
        Experiment.open(directory) as experiment,
        _explained(console),
        robot,
        signals.watched(),
        staffed_desk(robot, config.operator, show, signals.request) as desk,
        show_trials(console, robot.spec.name, n_trials, desk) as report,
    ):
        signals.guard(robot, desk)
        presence = Presence(desk, signals.request, more)
        with measuring(experiment.journal, config, robot, kind, plan, n_trials, presence) as ask:
            if ask.known:
                show(f"{ask.known} of {n_trials} trials were measured before; going on with the rest.")
            return ask.run_all(genomes, repeats, report), robot.timing


def must_be_computable(config: ExperimentConfig) -> None:
    """Refuse to simulate trials that only a person can say the worth of; before anything moves.

    Raises:
        ConfigError: the task is one of these.
    """
    if config.build_task().score_by_operator:
        raise ConfigError(
            "task.score_by_operator: a person says what each trial is worth, so there is nothing that a simulation "
            "could be compared by.",
            "`sceann repeat DIR` runs one genome again and again on the robot, and asks for the scores.",
        )


@contextmanager
def _explained(console: Console) -> Iterator[None]:
    """Whatever ends a measurement early says that nothing is lost."""
    kept = "What was measured is kept; the same command goes on from there."
    try:
        yield
    except Stopped as stopped:
        console.print(f"{stopped.message}. {kept}", markup=False, soft_wrap=True)
        raise typer.Exit(EXIT_CODES[stopped.reason]) from None
    except RobotError as error:
        told = as_user_error(error)
        if told is None:
            raise
        raise type(told)(told.message, f"Put that right, then give the same command again. {kept}") from error

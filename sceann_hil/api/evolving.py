"""Evolving from Python: a new run, or the rest of one that is there."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from sceann_hil.api.notebook import shown_progress
from sceann_hil.api.run import Run
from sceann_hil.config import ExperimentConfig, config_difference
from sceann_hil.errors import ConfigError
from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.run.experiment import Experiment
from sceann_hil.supervision.operators.staff import beside

if TYPE_CHECKING:
    from sceann_hil.run.experiment import Progress


def evolve(
    config: ExperimentConfig | None, directory: Path | str, *, progress: bool | Callable[[Progress], None] = False
) -> Run:
    """Evolve controllers; a run that is there already goes on where it stopped, and a finished one is only opened.

    Whoever the configuration puts beside the robot (`operator`) is there, as with `sceann evolve`. Interrupted, the
    robot is brought to its safe state first; the same call goes on.

    Args:
        config: what the run does; None goes on with a run whatever its configuration.
        directory: the run's folder.
        progress: show it, or a function that is called after every generation.

    Returns:
        The run; `Run.finished` says whether an operator or a budget ended it early.

    Raises:
        ConfigError: the run that is there was made with another configuration.
        RunExists, RunIsLocked, NotARun: why it cannot be begun or gone on with.
        RobotError: the robot's; the run can be gone on with.
    """
    directory = Path(directory)
    if (directory / JOURNAL_NAME).exists():
        run = Run(directory)
        _check_same(run, config)
        if run.finished:
            return run
        run.close()
        experiment = Experiment.open(directory)
    elif config is not None:
        experiment = Experiment.create(config, directory)
    else:
        return Run(directory)  # which says that there is none
    with experiment, ExitStack() as stack:
        robot = stack.enter_context(experiment.config.robot.build())
        report: Callable[[Progress], None] = progress if callable(progress) else lambda _: None
        if progress is True:
            report = stack.enter_context(shown_progress(experiment.config.algorithm.generations))
        desk = stack.enter_context(beside(robot, experiment.config.operator, print))
        experiment.evolve(robot, report, desk=desk)
    return Run(directory)


def _check_same(run: Run, config: ExperimentConfig | None) -> None:
    differences = [] if config is None else config_difference(run.config, config)
    if differences:
        run.close()
        shown = "; ".join(map(str, differences[:5])) + (" ..." if len(differences) > 5 else "")
        raise ConfigError(
            f"{run.directory} was made with another configuration: {shown}.",
            "Choose another folder, or go on with it as it is: evolve(None, directory).",
        )

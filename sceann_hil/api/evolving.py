"""Evolving and transferring from Python: a new run, or the rest of one that is there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from sceann_hil.api.notebook import shown_preparation, shown_progress
from sceann_hil.api.run import Run
from sceann_hil.config import ExperimentConfig, config_difference
from sceann_hil.errors import ConfigError, UserError
from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.run.experiment import Experiment
from sceann_hil.run.transfer.session import transfer_config
from sceann_hil.supervision.operators.staff import staffed_desk

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
        with shown_preparation() if progress is True else nullcontext() as preparing:
            experiment.config.algorithm.prepare(experiment.config, preparing)
        robot = stack.enter_context(experiment.config.robot.build())
        report: Callable[[Progress], None] = progress if callable(progress) else lambda _: None
        if progress is True:
            report = stack.enter_context(shown_progress(experiment.config.algorithm.generations))
        desk = stack.enter_context(staffed_desk(robot, experiment.config.operator, print))
        experiment.evolve(robot, report, desk=desk)
    return Run(directory)


def transfer(
    robot: ExperimentConfig | Path | str,
    directory: Path | str,
    *,
    sources: Sequence[Run | Path | str] = (),
    trials: int | None = None,
    rounds: int | None = None,
    target: float | None = None,
    evolve_first: int | None = None,
    again: Run | Path | str | None = None,
    progress: bool | Callable[[Progress], None] = False,
) -> Run:
    """Find the controller for a robot in a few trials, as `sceann transfer` does; `Run.conclusion` says what was found.

    The same call goes on with a transfer that was interrupted, and only opens one that is over.

    Args:
        robot: the experiment on the robot, or a YAML file of it, or one of no more than the section `robot`.
        directory: folder of the transfer's run.
        sources: runs and studies whose controllers are candidates.
        trials: most trials to choose by; 40 if neither this nor the file says.
        rounds: at the end the recommended controller does all trials of the task so many times.
        target: fitness that is enough.
        evolve_first: runs of evolution in simulated robots that give candidates; 100 without sources, else 0.
        again: an earlier transfer on this robot that is gone on from.
        progress: as for `evolve`.

    Raises:
        ConfigError: what does not fit; nothing was started.
        RunExists, RunIsLocked, NotARun, RobotError: as for `evolve`.
    """
    directory = Path(directory)
    config = transfer_config(
        robot if isinstance(robot, ExperimentConfig) else Path(robot),
        [_folder(source) for source in sources],
        trials=trials,
        rounds=rounds,
        target=target,
        evolve=evolve_first,
        again=None if again is None else _folder(again),
    )
    begun = (directory / JOURNAL_NAME).exists()
    try:
        return evolve(config, directory, progress=progress)
    except UserError:
        if not begun and (directory / JOURNAL_NAME).exists():
            with Experiment.open(directory) as experiment:
                experiment.forget()
        raise


def _folder(run: Run | Path | str) -> Path:
    return run.directory if isinstance(run, Run) else Path(run)


def _check_same(run: Run, config: ExperimentConfig | None) -> None:
    differences = [] if config is None else config_difference(run.config, config)
    if differences:
        run.close()
        shown = "; ".join(map(str, differences[:5])) + (" ..." if len(differences) > 5 else "")
        raise ConfigError(
            f"{run.directory} was made with another configuration: {shown}.",
            "Choose another folder, or go on with it as it is: evolve(None, directory).",
        )

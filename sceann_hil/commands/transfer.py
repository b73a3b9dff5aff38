"""From simulation to a robot in a few trials."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from sceann_hil.commands.arguments import (
    AsJson,
    BudgetRobot,
    BudgetTrials,
    BudgetWall,
    NewRun,
    OperatorOption,
    Overrides,
    Seed,
    more_of,
    operator_override,
    overrides_of,
)
from sceann_hil.commands.evolve import new_run, run_experiment
from sceann_hil.commands.progress import show_preparation
from sceann_hil.commands.recording import Live, Record, RecordChoice
from sceann_hil.commands.study_progress import told_when_interrupted
from sceann_hil.config import ExperimentConfig
from sceann_hil.run.transfer.session import transfer_config


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(transfer)


def transfer(
    robot: Annotated[
        Path,
        typer.Argument(
            metavar="ROBOT",
            help="YAML file of an experiment, or of a section robot.",
            show_default=False,
        ),
    ],
    sources: Annotated[
        list[Path] | None,
        typer.Option(
            "--from",
            metavar="DIR",
            help="Run or study whose controllers are candidates. Repeatable.",
            show_default="evolve some",
        ),
    ] = None,
    out: NewRun = None,
    trials: Annotated[
        int | None, typer.Option("--trials", min=1, help="Most trials to choose by.", show_default="40")
    ] = None,
    rounds: Annotated[
        int | None,
        typer.Option("--rounds", min=1, help="At the end, do all trials of the task so many times.", show_default="2"),
    ] = None,
    target: Annotated[
        float | None, typer.Option("--target", metavar="FITNESS", help="Stop once this fitness is as good as certain.")
    ] = None,
    evolve: Annotated[
        int | None,
        typer.Option(
            "--evolve",
            min=0,
            metavar="N",
            help="Runs of evolution in simulated robots that give candidates.",
            show_default="100; 0 with --from",
        ),
    ] = None,
    again: Annotated[
        Path | None,
        typer.Option("--again", metavar="DIR", help="Go on from a transfer: evolve in robots that this one resembles."),
    ] = None,
    cluster: Annotated[
        str | None, typer.Option("--cluster", metavar="ADDRESS", help="Simulate on the Dask cluster of this scheduler.")
    ] = None,
    seed: Seed = None,
    overrides: Overrides = None,
    record: Record = RecordChoice.ALL,
    live: Live = False,
    operator: OperatorOption = None,
    budget_robot: BudgetRobot = None,
    budget_wall: BudgetWall = None,
    budget_trials: BudgetTrials = None,
    as_json: AsJson = False,
) -> None:
    """Find the controller for a robot in a few trials, helped by many simulated robots.

    Before the robot moves, candidates are run in an ensemble of simulated robots (a minute or two, kept for the next
    time). Every trial on the robot then says which of them it resembles, and so which candidate is best on it.
    `sceann resume` goes on with a transfer that was stopped.

    Example: sceann transfer my_robot.yaml --from runs/first --out runs/transfer --trials 40

    Example: sceann transfer my_robot.yaml --again runs/transfer --out runs/further
    """
    settings = [*overrides_of(overrides, seed), *operator_override(operator)]
    config = transfer_config(
        robot,
        sources or (),
        trials=trials,
        rounds=rounds,
        target=target,
        evolve=evolve,
        again=again,
        settings=settings,
    )
    more = more_of(budget_robot, budget_wall, budget_trials)
    with new_run(config, out, robot.stem) as experiment:
        if cluster is not None:
            _prepare_on(cluster, config)
        run_experiment(experiment, record, live, as_json, more=more)


def _prepare_on(address: str, config: ExperimentConfig) -> None:
    """What takes long, on a cluster; it is kept here, so that a run begins at once."""
    from sceann_hil.study.cluster import ClusterWorkers  # an extra that most people do without
    from sceann_hil.study.transfer.on_cluster import prepare_on

    console = Console(stderr=True, highlight=False)
    with (
        told_when_interrupted(console),
        ClusterWorkers(address, tell=console.print) as workers,
        show_preparation(console) as preparing,
    ):
        prepare_on(workers, config, preparing)

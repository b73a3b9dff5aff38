"""A dress rehearsal: the whole run with a stand-in for the robot and a script for the person."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from sceann_hil.commands.arguments import AsJson, ConfigFile, Overrides, Seed, overrides_of, print_json
from sceann_hil.commands.printing import print_table
from sceann_hil.commands.progress import show_preparation, show_progress
from sceann_hil.config import journalled_config, load_config, with_robot_of
from sceann_hil.journal import JournalReader
from sceann_hil.run.champion import champion_of
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.run.plan import PROMPT_S
from sceann_hil.run.rehearsal import rehearsal
from sceann_hil.supervision.operators.staff import staffed_desk
from sceann_hil.timespans import duration_text


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(rehearse)


def rehearse(
    config: ConfigFile,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Keep the rehearsed run.", show_default="not kept")
    ] = None,
    body: Annotated[
        Path | None,
        typer.Option("--body", metavar="FILE", help="YAML with the robot section of the body that stands in."),
    ] = None,
    firmware: Annotated[
        bool,
        typer.Option("--firmware", help="With the robot's firmware on a virtual board; trials then take their time."),
    ] = False,
    prompt_s: Annotated[
        float, typer.Option("--prompt-s", min=0, help="Seconds that a person needs per prompt.")
    ] = PROMPT_S,
    seed: Seed = None,
    overrides: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Play a whole run, prompts included, with a simulated body for the robot and a script for the person.

    Example: sceann rehearse my_robot.yaml --set algorithm.generations=5

    Example: sceann rehearse my_robot.yaml --firmware --set algorithm.generations=0 --set algorithm.population=3
    """
    settings = load_config(config, overrides_of(overrides, seed))
    stand_in = with_robot_of(settings, body).robot if body is not None else None
    console = Console(stderr=True, highlight=False)
    with ExitStack() as open_ones:
        play = open_ones.enter_context(rehearsal(settings, stand_in, firmware=firmware))
        directory = out or Path(open_ones.enter_context(tempfile.TemporaryDirectory())) / "rehearsal"
        experiment = open_ones.enter_context(Experiment.create(play.config, directory))
        with show_preparation(console) as preparing:
            play.config.algorithm.prepare(play.config, preparing)
        robot = open_ones.enter_context(play.robot)
        desk = open_ones.enter_context(staffed_desk(robot, play.config.operator, lambda _: None))
        report = open_ones.enter_context(show_progress(console, play.config.algorithm.generations, desk))
        outcome = experiment.evolve(robot, report, desk=desk)
        document = _document(experiment.journal.reader, outcome, prompt_s, play.config.operator.confirm)
    if as_json:
        print_json(document)
        return
    table = Table(show_header=False)
    table.add_row("trials", f"{document['trials']}, of them void {document['void']}")
    table.add_row("prompts", f"{document['prompts']}")
    table.add_row("robot time", duration_text(document["robot_s"]))
    table.add_row(f"person's time at {prompt_s:g} s per prompt", duration_text(document["person_s"]))
    table.add_row("together", duration_text(document["robot_s"] + document["person_s"]))
    if document["best_fitness"] is not None:
        table.add_row("best fitness in the rehearsal", f"{document['best_fitness']:.4g}")
    print_table(Console(), f"Rehearsal of {config}: {document['outcome'].replace('_', ' ')}", table)


def _document(reader: JournalReader, outcome: Outcome, prompt_s: float, confirm: bool) -> dict[str, Any]:
    rows = [row for generation in reader.generations() for row in reader.attempts(generation.number)]
    asked = sum(row.operator_s is not None for row in rows)
    champion = champion_of(reader, keeps_best=journalled_config(reader).algorithm.keeps_best)
    prompts = asked * (2 if confirm else 1)
    return {
        "outcome": outcome.name.lower(),
        "trials": len(rows),
        "void": sum(row.fitness is None for row in rows),
        "prompts": prompts,
        "robot_s": sum(row.robot_s or 0.0 for row in rows),
        "person_s": prompts * prompt_s,
        "best_fitness": champion.fitness if champion is not None else None,
        "directory": str(reader.directory),
    }

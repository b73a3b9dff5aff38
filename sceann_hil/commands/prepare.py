"""Before a run: what there is, what a configuration may say, what it will cost."""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from sceann_hil.commands.arguments import AsJson, ConfigFile, Overrides, Seed, overrides_of, print_json
from sceann_hil.commands.printing import print_table
from sceann_hil.config import load_config, schema_text
from sceann_hil.registry import Group, available, package_of
from sceann_hil.run.plan import PROMPT_S, Plan
from sceann_hil.study import study_schema_text
from sceann_hil.timespans import duration_text


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command("list")(list_plugins)
    app.command()(schema)
    app.command()(plan)


def list_plugins(as_json: AsJson = False) -> None:
    """Show the installed robots, tasks and algorithms.

    Example: sceann list
    """
    groups = {group: available(group) for group in Group}
    if as_json:
        print_json(
            {group.name.lower(): {n: package_of(e) for n, e in found.items()} for group, found in groups.items()}
        )
        return
    table = Table("kind", "type", "from package")
    for group, found in groups.items():
        for name, entry in found.items():
            table.add_row(group.singular, f"[bold]{name}[/]", package_of(entry))
    Console().print(table)


def schema(
    study: Annotated[bool, typer.Option("--study", help="Of a study's file instead of an experiment's.")] = False,
) -> None:
    """Print the JSON schema of a configuration, for editors.

    Example: sceann schema > schema.json
    """
    typer.echo(study_schema_text() if study else schema_text(), nl=False)


def plan(config: ConfigFile, seed: Seed = None, overrides: Overrides = None, as_json: AsJson = False) -> None:
    """Show what a configuration will cost, without running anything.

    Example: sceann plan configs/goal_reach.yaml --set algorithm.population=10
    """
    forecast = Plan.of(load_config(config, overrides_of(overrides, seed)))
    if as_json:
        print_json(forecast.as_dict())
        return
    table = Table(show_header=False)
    table.add_row("genome", f"{forecast.genome_length} bits, {forecast.n_genomes_in_space}")
    table.add_row("network", forecast.network)
    table.add_row("generations", f"{forecast.generations} of {forecast.population} individuals")
    table.add_row("trials", f"{forecast.trials} ({forecast.trials_per_individual} per individual)")
    table.add_row(
        "robot time at most",
        f"{duration_text(forecast.longest_robot_s)} ({duration_text(forecast.longest_trial_s)} per trial)",
    )
    table.add_row("prompts to a person", str(forecast.prompts))
    if not forecast.simulated:
        table.add_row("wall time at most", f"{duration_text(forecast.longest_wall_s)} ({PROMPT_S:g} s per prompt)")
    else:
        table.add_row("wall time", "far less: robot time is simulated")
    table.add_row(
        "recording every trial",
        f"at most {forecast.recording_bytes / 1e6:,.0f} MB and {duration_text(forecast.recording_s)} of one core, "
        "in the background",
    )
    table.add_row("less of it", "--record best: one individual of a generation; --record none: only what is looked at")
    if forecast.fits:
        table.add_row("within the budget", forecast.fits)
    print_table(Console(), f"Plan of {config}", table)

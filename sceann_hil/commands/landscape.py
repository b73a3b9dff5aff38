"""Exact landscapes of short genomes."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from sceann_hil.commands.arguments import AsJson, ConfigFile, Overrides, Seed, overrides_of, print_json
from sceann_hil.commands.study_progress import tell_disk_full, told_when_interrupted
from sceann_hil.pasting import pasteable
from sceann_hil.study import cores, load_conditions
from sceann_hil.study.condition import Condition
from sceann_hil.study.landscape import Summary, analyse, enumerate_landscape
from sceann_hil.study.landscape.enumeration import check_enumerable


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command("enumerate")(enumerate_genomes)


def enumerate_genomes(
    config: ConfigFile,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder of the studies.", show_default="studies")
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Cores to use.", show_default="all cores")
    ] = None,
    accept_versions: Annotated[
        bool, typer.Option("--accept-versions", help="Go on although versions are others than before.")
    ] = False,
    seed: Seed = None,
    overrides: Overrides = None,
    as_json: AsJson = False,
) -> None:
    """Try every genome of an experiment, or of each condition of a study; NumPy arrays go to DIR/NAME/landscapes.

    Stopped or killed, the same command goes on where it was. Genomes may have up to 26 bits.

    Example: sceann enumerate configs/paper/landscape.yaml --out studies
    """
    name, conditions = load_conditions(config, overrides_of(overrides, seed))
    for condition in conditions:
        check_enumerable(condition.config)
    folder = (out or Path("studies")) / name / "landscapes"
    console = Console(stderr=True, highlight=False)
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("ETA"), TimeRemainingColumn(compact=True))
    found: dict[str, Summary] = {}
    with told_when_interrupted(console), Progress(*columns, console=console, transient=True) as bars:
        for condition in conditions:
            bar = bars.add_task(condition.label, total=None)

            def report(done: int, n: int, bar: object = bar) -> None:
                bars.update(bar, completed=done, total=n)  # type: ignore[arg-type]

            landscape = enumerate_landscape(
                condition.config,
                folder / _folder_name(condition),
                workers or cores(),
                report,
                partial(tell_disk_full, console),
                accept_other_versions=accept_versions,
            )
            found[condition.label] = analyse(landscape)
            bars.remove_task(bar)
    if as_json:
        print_json({label: {name: getattr(s, name) for name in s.__slots__} for label, s in found.items()})
        return
    _print(Console(highlight=False), found)
    console.print(f"  sceann report {pasteable(out or Path('studies'))}", markup=False, soft_wrap=True)


def _folder_name(condition: Condition) -> str:
    size, controller = condition.config.size, condition.config.controller
    return (
        f"{controller.coding.value}-{size.n_sensors}-{size.n_hidden}-{controller.neuron.value}-"
        f"{condition.identity:016x}"
    )


def _print(console: Console, found: dict[str, Summary]) -> None:
    table = Table("condition", "genomes", "solutions", "best", "solutions among neighbours", "random search succeeds")
    for label, summary in found.items():
        table.add_row(
            label,
            f"2^{summary.length}",
            f"{summary.n_solutions} ({summary.fraction:.2g})",
            f"{summary.best_fitness:.4g}",
            f"{summary.neighbours_mean:.2f} of {summary.length}",
            f"{summary.random_search:.1%} of {summary.budget} tries",
        )
    console.print(table)

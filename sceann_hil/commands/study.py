"""Studies: many runs of many conditions."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from sceann_hil.commands.arguments import Overrides, Seed, overrides_of
from sceann_hil.commands.study_progress import show_study_progress, told_when_interrupted
from sceann_hil.errors import ConfigError
from sceann_hil.pasting import pasteable
from sceann_hil.study import LocalWorkers, Study, cores, load_study, run_study
from sceann_hil.study.runner import Workers


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(study)


def study(
    config: Annotated[
        Path, typer.Argument(metavar="CONFIG", help="A study's YAML file, or a folder of them.", show_default=False)
    ],
    runs: Annotated[int | None, typer.Option("--runs", min=1, help="Independent runs of each condition.")] = None,
    cluster: Annotated[
        str | None, typer.Option("--cluster", metavar="ADDRESS", help="Compute on the Dask cluster of this scheduler.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Processes on this machine.", show_default="all cores")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder of the studies.", show_default="studies")
    ] = None,
    accept_versions: Annotated[
        bool, typer.Option("--accept-versions", help="Go on although versions are others than before.")
    ] = False,
    seed: Seed = None,
    overrides: Overrides = None,
) -> None:
    """Run every condition of a study many times; results go to DIR/NAME/study.sqlite.

    Stopped or killed, the same command goes on where it was, with the same numbers; more --runs add to it.

    Example: sceann study configs/paper/tables.yaml --runs 1000 --out studies
    """
    if cluster is not None and workers is not None:
        raise typer.BadParameter("--cluster and --workers exclude each other")
    settings = overrides_of(overrides, seed) + ([] if runs is None else [f"runs={runs}"])
    studies = [load_study(path, settings) for path in _files(config)]
    console = Console(stderr=True, highlight=False)
    directory = out or Path("studies")
    if cluster is None:
        _run(studies, directory, LocalWorkers(workers or cores()), console, accept_versions)
        return
    from sceann_hil.study.cluster import ClusterWorkers  # an extra that most people do without

    with told_when_interrupted(console), ClusterWorkers(cluster, tell=console.print) as on_the_cluster:
        _run(studies, directory, on_the_cluster, console, accept_versions)


def _files(config: Path) -> list[Path]:
    if not config.is_dir():
        return [config]
    files = sorted(config.glob("*.yaml"))
    if not files:
        raise ConfigError(f"{config}: expected YAML files in this folder, got none", "Name a study's file.")
    return files


def _run(studies: list[Study], directory: Path, workers: Workers, console: Console, accept_versions: bool) -> None:
    for one in studies:
        console.rule(f"[bold]{escape(one.config.name)}[/]", align="left")
        with told_when_interrupted(console), show_study_progress(console) as observer:
            run_study(one, directory / one.config.name, workers, observer, accept_other_versions=accept_versions)
    console.print(f"  sceann report {pasteable(directory)}", markup=False, soft_wrap=True)

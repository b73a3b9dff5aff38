"""Looking at a run in the viewer."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from sceann_hil.commands.arguments import RunDirectory
from sceann_hil.commands.recording import show_recording
from sceann_hil.recording import Detail, RecordingPaths
from sceann_hil.recording.process import wait_for_recorder


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(view)
    app.command()(record)


def view(
    directory: RunDirectory,
    trial: Annotated[int | None, typer.Option("--trial", metavar="N", help="One trial, by its number.")] = None,
    run: Annotated[bool, typer.Option("--run", help="The run over its generations.")] = False,
    web: Annotated[bool, typer.Option("--web", help="In the browser instead of a window.")] = False,
    picture: Annotated[
        Path | None, typer.Option("--picture", metavar="FILE.png", help="Draw it into a file; needs no display.")
    ] = None,
    serve: Annotated[
        bool, typer.Option("--serve", help="For a browser elsewhere: print a link with a token, until Ctrl-C.")
    ] = False,
    host: Annotated[str, typer.Option("--host", help="For --serve: address to listen on.")] = "0.0.0.0",
    port: Annotated[int, typer.Option("--port", min=0, max=65_535, help="For --serve: 0 for any that is free.")] = 8076,
    at: Annotated[float | None, typer.Option(help="For --picture: seconds into the trial, or the generation.")] = None,
) -> None:
    """Show all trials of a run sorted by fitness, one trial, or the run as a whole.

    What has not been recorded yet is recorded first.

    Example: sceann view runs/first --trial 17

    Example: sceann view runs/first --serve
    """
    from sceann_hil.recording import view as viewing  # rerun takes a second to import

    if trial is not None and run:
        raise typer.BadParameter("choose --trial N or --run, not both")
    screen = viewing.Screen(trial=trial, overview=run)
    console = Console(stderr=True, highlight=False)
    if picture is not None:
        complaints = viewing.picture(directory, screen, picture, at)
        for name, said in complaints.items():
            console.print(f"{name}: {'; '.join(said)}", markup=False)
        typer.echo(picture)
        return
    if serve:
        from sceann_hil.recording.serve import serve as serve_viewer

        with show_recording(console) as report:
            prepared = ExitStack()
            source = prepared.enter_context(viewing.prepared(directory, screen, report))
        with prepared:
            serve_viewer(source, host, port, partial(console.print, markup=False, soft_wrap=True))
        return
    with show_recording(console) as report:
        viewing.view(directory, screen, viewing.Window.WEB if web else viewing.Window.NATIVE, report)


def record(
    directory: RunDirectory,
    trials: Annotated[Detail, typer.Option("--record", help="All trials, or those of each generation's best.")] = (
        Detail.ALL
    ),
) -> None:
    """Make the recordings of a run that are missing or damaged, from its journal; wait for whoever makes them already.

    Example: sceann record runs/first
    """
    from sceann_hil.recording.recorder import Recorder

    with show_recording(Console(stderr=True, highlight=False)) as report:
        wait_for_recorder(directory, report)
        recorder = Recorder(directory, trials, report)
        try:
            recorder.record()
        finally:
            recorder.close()
    typer.echo(RecordingPaths(directory).folder)

"""The `sceann` command: options of its own, and what happens to errors. The commands are in `sceann_hil.commands`."""

from __future__ import annotations

import sys
import traceback
from importlib.metadata import version
from typing import Annotated

import typer

from sceann_hil.commands import inherited
from sceann_hil.commands.lazy import LazyCommands, add_placeholders
from sceann_hil.commands.streams import prepare as prepare_streams

app = typer.Typer(
    name="sceann",
    cls=LazyCommands,
    help="Evolve tiny neural controllers in simulation, then go on with a real robot.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: see docs/exit-codes.md. Start with: sceann evolve configs/quickstart.yaml",
)
add_placeholders(app)


_with_traceback = False
"""Somebody asked for it: the traceback of an error is printed above its message."""


def _show_traceback(wanted: bool) -> None:
    global _with_traceback
    _with_traceback = wanted


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"sceann-hil {version('sceann-hil')}")
        raise typer.Exit


@app.callback()
def options(
    show_version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Show the version and exit.")
    ] = False,
    show_traceback: Annotated[
        bool,
        typer.Option("--traceback", callback=_show_traceback, is_eager=True, help="Show where an error came from."),
    ] = False,
) -> None:
    """Evolve tiny neural controllers in simulation, then go on with a real robot."""


def main() -> None:
    """Run the command line; a user's error gets its message and its exit code, a bug keeps its traceback."""
    try:
        inherited.set_right()
        prepare_streams()
        try:
            app()
        finally:
            # a full disk behind standard output is told here, not by the interpreter on its way out
            sys.stdout.flush()
    except (Exception, KeyboardInterrupt) as error:
        from rich.console import Console
        from rich.markup import escape

        from sceann_hil.errors import as_user_error
        from sceann_hil.plugin_faults import plugin_fault

        told = as_user_error(error) or plugin_fault(error)
        if told is None:
            raise
        if _with_traceback:
            traceback.print_exception(error)
        console = Console(stderr=True, highlight=False)
        console.print(f"[bold red]Error:[/] {escape(told.message)}", soft_wrap=True)
        if told.hint:
            console.print(f"[bold]What to do:[/] {escape(told.hint)}", soft_wrap=True)
        sys.exit(told.exit_code)


if __name__ == "__main__":
    main()

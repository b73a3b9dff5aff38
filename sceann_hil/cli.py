"""The `sceann` command: one function per command in `sceann_hil.commands`, and what happens to errors."""

from __future__ import annotations

import sys
from importlib.metadata import entry_points

import typer
from rich.console import Console
from rich.markup import escape

from sceann_hil.commands import (
    champion,
    evolve,
    firmware,
    gap,
    hardware,
    inspect,
    landscape,
    observe,
    prepare,
    rehearse,
    report,
    study,
)
from sceann_hil.errors import as_user_error

app = typer.Typer(
    name="sceann",
    help="Evolve tiny neural controllers in simulation, then go on with a real robot.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Exit codes: see docs/exit-codes.md. Start with: sceann evolve configs/quickstart.yaml",
)
MODULES = (prepare, rehearse, evolve, inspect, observe, gap, study, landscape, report, champion, firmware, hardware)
for module in MODULES:
    module.register(app)
for entry in entry_points(group="sceann_hil.commands"):
    entry.load()(app)


def main() -> None:
    """Run the command line; a user's error gets its message and its exit code, a bug keeps its traceback."""
    try:
        app()
    except Exception as error:
        told = as_user_error(error)
        if told is None:
            raise
        console = Console(stderr=True, highlight=False)
        console.print(f"[bold red]Error:[/] {escape(told.message)}", soft_wrap=True)
        if told.hint:
            console.print(f"[bold]What to do:[/] {escape(told.hint)}", soft_wrap=True)
        sys.exit(told.exit_code)


if __name__ == "__main__":
    main()

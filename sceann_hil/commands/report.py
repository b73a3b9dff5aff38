"""The report of a folder of studies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(report)


def report(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of a study, of several, or of a run.", show_default=False)
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Where the report goes.", show_default="DIR/report")
    ] = None,
) -> None:
    """Write the paper's tables, figures and claims with our numbers beside them: Markdown, SVG, PNG and one HTML page.

    Example: sceann report studies
    """
    from sceann_hil.study.report import (
        write_report,  # Matplotlib and SciPy take a second, and no other command needs them
    )

    for path in write_report(directory, out or directory / "report"):
        Console(highlight=False).print(str(path), soft_wrap=True)

"""Arguments that several commands share, and printing for programs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

RunDirectory = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run.", show_default=False)]
ConfigFile = Annotated[Path, typer.Argument(metavar="CONFIG", help="A YAML file.", show_default=False)]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one key, such as algorithm.population=50. Repeatable."),
]
Seed = Annotated[int | None, typer.Option("--seed", min=0, help="Root seed; the same as --set seed=N.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON document for programs.")]


def overrides_of(overrides: list[str] | None, seed: int | None) -> list[str]:
    """``--set`` and ``--seed`` as one list."""
    return [*(overrides or []), *([] if seed is None else [f"seed={seed}"])]


def print_json(document: dict[str, Any]) -> None:
    """Print `document` on standard output."""
    typer.echo(json.dumps(document, indent=2))

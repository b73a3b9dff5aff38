"""Arguments that several commands share, and printing for programs."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Annotated, Any

import typer

RunDirectory = Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a run.", show_default=False)]
NewRun = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder of the new run.", show_default="runs/NAME-TIME")
]
ConfigFile = Annotated[Path, typer.Argument(metavar="CONFIG", help="A YAML file.", show_default=False)]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change one key, such as algorithm.population=50. Repeatable."),
]
Seed = Annotated[int | None, typer.Option("--seed", min=0, help="Root seed; the same as --set seed=N.")]
OperatorOption = Annotated[
    str | None,
    typer.Option(
        "--operator",
        metavar="WHO",
        help="Who stands beside the robot: none, console, web, script, or several (console,web).",
        show_default="as configured",
    ),
]
BudgetRobot = Annotated[
    str | None, typer.Option("--budget-robot", metavar="TIME", help="Robot time for this, such as 2h or 90min.")
]
BudgetWall = Annotated[
    str | None, typer.Option("--budget-wall", metavar="TIME", help="Wall time for this, such as 3h.")
]
BudgetTrials = Annotated[int | None, typer.Option("--budget-trials", min=1, metavar="N", help="Trials for this.")]
Genome = Annotated[
    str,
    typer.Option("--genome", metavar="best|G:N", help="Which individual: the best, or number N of generation G."),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON document for programs.")]


def overrides_of(overrides: list[str] | None, seed: int | None) -> list[str]:
    """``--set`` and ``--seed`` as one list."""
    return [*(overrides or []), *([] if seed is None else [f"seed={seed}"])]


def operator_override(who: str | None) -> list[str]:
    """``--operator`` as a ``--set``."""
    return [] if who is None else [f"operator.who=[{who}]"]


def more_of(robot: str | None, wall: str | None, trials: int | None) -> dict[str, float]:
    """The ``--budget-`` options as amounts by name.

    Raises:
        typer.BadParameter: a time is no time.
    """
    from sceann_hil.timespans import parse_duration_s  # pydantic comes with it, and the help needs none

    try:
        times = {"robot_s": robot and parse_duration_s(robot), "wall_s": wall and parse_duration_s(wall)}
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    return {name: float(value) for name, value in {**times, "trials": trials}.items() if value}


def print_json(document: dict[str, Any]) -> None:
    """Print `document` on standard output."""
    typer.echo(json_text(document))


def json_text(document: dict[str, Any]) -> str:
    """`document` as JSON that every reader takes: JSON knows neither NaN nor infinity, so null stands for them."""
    return json.dumps(_finite(document), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value

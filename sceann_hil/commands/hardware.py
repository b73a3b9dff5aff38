"""Robots that can be touched: is this one fit for work?"""

from __future__ import annotations

from contextlib import closing
from functools import partial
from pathlib import Path
from textwrap import indent
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from sceann_hil.commands.arguments import AsJson, print_json
from sceann_hil.commands.ending import EXIT_CODES
from sceann_hil.config import ExperimentConfig, load_config
from sceann_hil.errors import ConfigError, RobotIsFaulty
from sceann_hil.robot import Robot
from sceann_hil.robot.diagnosis import Finding, Verdict
from sceann_hil.run.examination import examined
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.signals import Signals

_COLOUR = {Verdict.GOOD: "green", Verdict.BAD: "bold red", Verdict.NOT_DONE: "yellow"}


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(doctor)


def doctor(
    robot: Annotated[
        Path,
        typer.Option("--robot", metavar="CONFIG", help="A configuration; its robot is examined.", show_default=False),
    ],
    move: Annotated[bool, typer.Option("--move", help="The wheels are off the ground: try the motors too.")] = False,
    as_json: AsJson = False,
) -> None:
    """Examine a robot: port, handshake, latency, losses, watchdog, sensors and motors, each with advice.

    The configuration's suspenders hold for the motors too, and Ctrl-C stops the robot first.

    Example: sceann doctor --robot configs/my_robot.yaml --move
    """
    findings = []
    console = Console(highlight=False)
    config = load_config(robot)
    body = _robot(robot, config)
    signals = Signals(
        partial(Console(stderr=True, highlight=False).print, markup=False),
        soon=lambda: "Stopping after this check.",
    )
    desk = Desk(asks=False, on_emergency=body.make_safe, stop=signals.request)
    signals.beside(body, desk)
    with signals.watched(), closing(examined(body, config, desk, may_move=move)) as checks:
        for finding in checks:
            findings.append(finding)
            if not as_json:
                _print(console, finding)
            if (stopped := signals.request().at_once) is not None:
                raise typer.Exit(EXIT_CODES[stopped.reason])
    if (stopped := signals.request().at_once) is not None:
        raise typer.Exit(EXIT_CODES[stopped.reason])
    if as_json:
        print_json(
            {
                "findings": [
                    {"check": f.check, "verdict": f.verdict.value, "detail": f.detail, "advice": f.advice}
                    for f in findings
                ]
            }
        )
    bad = [finding.check for finding in findings if finding.verdict is Verdict.BAD]
    if bad:
        raise RobotIsFaulty(f"The robot is not fit for work: {', '.join(bad)}.", "Follow the advice above.")


def _robot(path: Path, config: ExperimentConfig) -> Robot:
    try:
        return config.robot.build()
    except ValueError as error:
        raise ConfigError(f"{path}: robot: {error}") from error


def _print(console: Console, finding: Finding) -> None:
    console.print(f"[{_COLOUR[finding.verdict]}]{finding.verdict.value:>8}[/]  [bold]{escape(finding.check)}[/]")
    console.print(indent(finding.detail, " " * 10), soft_wrap=True, markup=False)
    if finding.advice:
        console.print(indent(f"Advice: {finding.advice}", " " * 10), soft_wrap=True, markup=False)

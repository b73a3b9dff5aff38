"""Robots that can be touched: is this one fit for work?"""

from __future__ import annotations

from pathlib import Path
from textwrap import indent
from typing import Annotated

import typer
from rich.console import Console

from sceann_hil.commands.arguments import AsJson, print_json
from sceann_hil.config import load_config
from sceann_hil.errors import ConfigError, RobotIsFaulty
from sceann_hil.plugins import RobotConfig
from sceann_hil.robot import Robot
from sceann_hil.robot.diagnosis import Finding, Verdict

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

    Example: sceann doctor --robot configs/my_robot.yaml --move
    """
    findings = []
    console = Console(highlight=False)
    for finding in _robot(robot).diagnose(may_move=move):
        findings.append(finding)
        if not as_json:
            _print(console, finding)
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


def _robot(config: Path) -> Robot:
    section: RobotConfig = load_config(config).robot
    try:
        return section.build()
    except ValueError as error:
        raise ConfigError(f"{config}: robot: {error}") from error


def _print(console: Console, finding: Finding) -> None:
    console.print(f"[{_COLOUR[finding.verdict]}]{finding.verdict.value:>8}[/]  [bold]{finding.check}[/]")
    console.print(indent(finding.detail, " " * 10), soft_wrap=True, markup=False)
    if finding.advice:
        console.print(indent(f"Advice: {finding.advice}", " " * 10), soft_wrap=True, markup=False)

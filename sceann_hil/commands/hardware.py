"""Robots that can be touched: is this one fit for work?"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from pathlib import Path
from textwrap import indent
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape

from sceann_hil.commands.arguments import AsJson, OperatorOption, operator_override, print_json
from sceann_hil.commands.ending import EXIT_CODES
from sceann_hil.config import ExperimentConfig, load_config
from sceann_hil.errors import ConfigError, RobotIsFaulty
from sceann_hil.journal import JOURNAL_NAME
from sceann_hil.robot import Robot
from sceann_hil.robot.diagnosis import Finding, Verdict
from sceann_hil.run.examination import examined
from sceann_hil.run.experiment import Experiment
from sceann_hil.run.session import Presence
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.operators.staff import staffed_desk
from sceann_hil.supervision.signals import Signals
from sceann_hil.supervision.stopping import Stopped

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
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="With --move: the run in whose journal movements are kept; made if it is new.",
            show_default="runs/doctor-NAME",
        ),
    ] = None,
    operator: OperatorOption = None,
    as_json: AsJson = False,
) -> None:
    """Examine a robot: port, handshake, latency, losses, watchdog, sensors and motors, each with advice.

    The motors are moved as a run moves them: operator, suspenders, budget and journal hold, and Ctrl-C stops the
    robot first. While a run works in that folder nothing is touched.

    Example: sceann doctor --robot configs/my_robot.yaml --move
    """
    if out is not None and not move:
        raise typer.BadParameter("expected --move too: nothing else is kept in a journal", param_hint="--out")
    config = load_config(robot, operator_override(operator))
    body = _robot(robot, config)
    findings = []
    console = Console(highlight=False)
    show = partial(Console(stderr=True, highlight=False).print, markup=False, soft_wrap=True)
    signals = Signals(show, soon=lambda: "Stopping after this check.")
    stopped: Stopped | None = None
    with ExitStack() as block:
        run, desk = None, Desk(asks=False, on_emergency=body.make_safe, stop=signals.request)
        if move:
            run = block.enter_context(_run(config, out, robot.stem))
        block.enter_context(signals.watched())
        if move:
            desk = block.enter_context(staffed_desk(body, config.operator, show, signals.request))
        signals.guard(body, desk)
        journal = run.journal if run is not None else None
        checks = block.enter_context(closing(examined(body, config, Presence(desk, signals.request), journal)))
        for finding in checks:
            findings.append(finding)
            if not as_json:
                _print(console, finding)
            if (stopped := signals.request().at_once) is not None:
                break
    if (stopped := stopped or signals.request().at_once) is not None:
        raise typer.Exit(EXIT_CODES[stopped.reason])
    if as_json:
        print_json(
            {
                "findings": [
                    {"check": f.check, "verdict": f.verdict.value, "detail": f.detail, "advice": f.advice}
                    for f in findings
                ],
                "journal": str(run.directory) if run is not None and run.directory.exists() else None,
            }
        )
    elif run is not None and run.directory.exists():
        show(f"The movements are in the journal of {run.directory}.")
    bad = [finding.check for finding in findings if finding.verdict is Verdict.BAD]
    if bad:
        raise RobotIsFaulty(f"The robot is not fit for work: {', '.join(bad)}.", "Follow the advice above.")


def _robot(path: Path, config: ExperimentConfig) -> Robot:
    try:
        return config.robot.build()
    except ValueError as error:
        raise ConfigError(f"{path}: robot: {error}") from error


@contextmanager
def _run(config: ExperimentConfig, out: Path | None, name: str) -> Iterator[Experiment]:
    """Where movements are kept; a folder that was made for them goes again if there were none."""
    directory = out or Path("runs") / f"doctor-{name}"
    new = not (directory / JOURNAL_NAME).exists()
    with Experiment.create(config, directory) if new else Experiment.open(directory) as experiment:
        # the doctor's own folder is no evolution, which other versions would make another one
        experiment.journal.accept_other_versions = out is None
        try:
            yield experiment
        finally:
            if new:
                experiment.forget()


def _print(console: Console, finding: Finding) -> None:
    console.print(f"[{_COLOUR[finding.verdict]}]{finding.verdict.value:>8}[/]  [bold]{escape(finding.check)}[/]")
    console.print(indent(finding.detail, " " * 10), soft_wrap=True, markup=False)
    if finding.advice:
        console.print(indent(f"Advice: {finding.advice}", " " * 10), soft_wrap=True, markup=False)

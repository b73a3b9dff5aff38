"""``sceann virtual``: robots for people without hardware."""

from __future__ import annotations

import signal
import socket
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sceann_hil.commands import Topic
from sceann_hil.commands.arguments import Overrides

if TYPE_CHECKING:
    from sceann_hil.config import ExperimentConfig


def register(app: typer.Typer) -> None:
    """Add this module's command. `sceann --help` imports this module: what the command needs, it imports itself."""
    app.command(rich_help_panel=Topic.ROBOT.value)(virtual)


def virtual(
    board: Annotated[
        str,
        typer.Argument(
            metavar="BOARD", help="posix, uno (simavr), lm3s6965, stm32f405 or microbit (QEMU, mode hil only)."
        ),
    ],
    config: Annotated[
        Path | None,
        typer.Argument(metavar="[CONFIG]", help="Its simulated robot becomes the body, gap and all.", exists=True),
    ] = None,
    port: Annotated[
        Path | None, typer.Option("--port", metavar="PATH", help="A link to the serial port, at a path of your choice.")
    ] = None,
    write: Annotated[
        Path | None,
        typer.Option("--write", metavar="FILE", help="Write CONFIG with this robot in place of the simulated one."),
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(
            "--mode", help="What --write says: onboard, tethered or hil.", show_default="onboard; hil without a body"
        ),
    ] = None,
    baud: Annotated[
        int | None,
        typer.Option("--baud", min=1200, help="posix: pace the line like a UART.", show_default="as fast as it goes"),
    ] = None,
    can: Annotated[
        str | None, typer.Option("--can", metavar="INTERFACE:CHANNEL", help="On a python-can bus instead of a port.")
    ] = None,
    store: Annotated[Path | None, typer.Option("--store", metavar="FILE", help="Keeps what an EEPROM keeps.")] = None,
    rig_port: Annotated[int, typer.Option("--rig-port", min=0, max=65_535, help="TCP port of the rig; 0 for any.")] = 0,
    battery_s: Annotated[
        float, typer.Option("--battery-s", min=0.1, help="Driven time that the battery lasts.")
    ] = 3600.0,
    node: Annotated[int, typer.Option("--node", min=1, max=127, help="Its number on a bus.")] = 1,
    seed: Annotated[
        int, typer.Option("--seed", min=0, help="Of the body's noise, and of its gap: another seed is another robot.")
    ] = 1,
    overrides: Overrides = None,
) -> None:
    """Switch on a virtual robot: our firmware on a virtual board, a simulated body on its pins, a port like a real one.

    Runs until Ctrl-C. A rig at a TCP port puts the body back, so that nobody has to stand beside it.

    Example: sceann virtual posix configs/quickstart.yaml --set robot.gap.sensor_noise=0.01 --write robot.yaml
    """
    import yaml
    from rich.console import Console

    from backends.virtual.power import VirtualRobot, switch_on
    from sceann_hil.config import load_config
    from sceann_hil.errors import ConfigError
    from sceann_hil.firmware.build import board_named

    settings = load_config(config, overrides or []) if config is not None else None
    with ExitStack() as stack:
        robot: VirtualRobot = stack.enter_context(
            switch_on(
                board_named(board),
                settings.robot if settings is not None else None,
                port=port,
                can=can,
                baud=baud,
                store=store,
                rig_port=rig_port,
                battery_s=battery_s,
                seed=seed,
                node=node,
                # a body in a wall would press its bumper before anybody has touched it
                start=settings.build_task().starts[0].tolist() if settings is not None else None,
            )
        )
        section = robot.section(mode)
        console = Console(highlight=False)
        if write is not None:
            if settings is None:
                raise ConfigError("--write needs CONFIG: it is CONFIG with another robot.", "Name a configuration.")
            write.write_text(with_robot(settings, section), encoding="utf-8")
            console.print(f"Configuration with this robot: {write}")
        console.print(f"Virtual {board} is on. As a [bold]robot[/] section:")
        print(yaml.safe_dump({"robot": section}, sort_keys=False, default_flow_style=None), end="", flush=True)
        console.print("Ctrl-C switches it off.")
        _wait_for_interrupt()


def with_robot(settings: ExperimentConfig, section: dict[str, Any]) -> str:
    """A configuration with another robot, as YAML."""
    import yaml

    from sceann_hil.config import dump_config

    document = yaml.safe_load(dump_config(settings))
    document["robot"] = section
    return yaml.safe_dump(document, sort_keys=False)


def _wait_for_interrupt() -> None:
    ours, theirs = socket.socketpair()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: theirs.send(b"x"))
    ours.recv(1)

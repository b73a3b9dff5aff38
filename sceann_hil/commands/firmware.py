"""From a run to a microcontroller: the C header, the board, the proof."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from itertools import chain
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import Progress

from sceann_hil.commands.arguments import AsJson, Genome, RunDirectory, print_json
from sceann_hil.commands.thymio import aesl_of, flash_thymio, verify_thymio
from sceann_hil.config.journalled import journalled_config
from sceann_hil.errors import FirmwareBuildFailed, RobotUnreachable, VerifyDiffers
from sceann_hil.firmware.build import THYMIO, Board, board_named
from sceann_hil.firmware.flash import OnRobot, Unplugged, flash, flash_genome, handshake, opened
from sceann_hil.firmware.flash_plan import UPLOAD_BAUDS, plan_flash, upload_firmware
from sceann_hil.firmware.from_run import load_image, recorded_sensors
from sceann_hil.firmware.header import Optimize, c_header, checked_name, write_header
from sceann_hil.firmware.verify import random_sequences, verify
from sceann_hil.journal import JournalReader
from sceann_hil.link.framed_bus import LineBus
from sceann_hil.link.messages import node_arguments
from sceann_hil.link.ports import the_only_port
from sceann_hil.link.serial_bus import BAUD
from sceann_hil.link.session import Refused, RobotLink
from sceann_hil.link.vocabulary import Op, Status, StoreAction
from sceann_hil.robot import LinkError

BoardName = Annotated[
    str | None,
    typer.Option(
        "--board", help=f"One of {', '.join((*(board.value for board in Board), THYMIO))}.", show_default=False
    ),
]
Node = Annotated[int, typer.Option("--node", min=1, max=127, help="Which robot on the bus.")]
Port = Annotated[str | None, typer.Option("--port", help="Serial port or pyserial URL.", show_default=False)]
Baud = Annotated[int, typer.Option("--baud", help="Its speed.")]
Name = Annotated[str, typer.Option("--name", help="Prefix of everything in the header, a C identifier.")]


class Language(StrEnum):
    """What a controller is written in."""

    C = "c"
    AESL = "aesl"


def register(app: typer.Typer) -> None:
    """Add this module's commands."""
    app.command()(export)
    app.command("flash")(flash_board)
    app.command("verify")(verify_board)
    app.command("set-node")(set_node)


def export(
    directory: RunDirectory,
    genome: Genome = "best",
    output: Annotated[Path | None, typer.Option("-o", "--output", help="File; standard output without it.")] = None,
    name: Name = "controller",
    optimize: Annotated[Optimize, typer.Option("--optimize", help="What the code saves.")] = Optimize.SPEED,
    language: Annotated[
        Language, typer.Option("--language", help="c: a header. aesl: a program for a Thymio II.")
    ] = Language.C,
) -> None:
    """Write a controller as one self-contained C header, or as a program for a Thymio II.

    Example: sceann export runs/first --name walker -o walker.h
    """
    checked_name(name)
    reader = JournalReader(directory)
    if language is Language.AESL:
        image = load_image(reader, genome, "--language aesl", _note)
        text = aesl_of(image, journalled_config(reader).robot)
    else:
        image = load_image(reader, genome, f"--name {name} --optimize {optimize.value}", _note)
        text = c_header(image, name, optimize)
    if output is None:
        typer.echo(text, nl=False)
    else:
        write_header(output, text)


def flash_board(
    directory: RunDirectory,
    board: BoardName = None,
    genome: Genome = "best",
    port: Port = None,
    baud: Baud = BAUD,
    node: Node = 1,
    autorun: Annotated[
        float | None,
        typer.Option("--autorun", metavar="MS", help="Run it without a host, with this control period."),
    ] = None,
    on_button: Annotated[
        bool, typer.Option("--on-button", help="With --autorun: when the start button is pressed, not by itself.")
    ] = False,
    upload_baud: Annotated[
        int, typer.Option("--upload-baud", help="Speed of the boot loader; 57600 is tried by itself.")
    ] = UPLOAD_BAUDS[0],
    can: Annotated[
        bool, typer.Option("--can", help="The robot's link is on CAN, not on a serial port (stm32f405).")
    ] = False,
    header_only: Annotated[bool, typer.Option("--header-only", help="Only write controller.h here.")] = False,
    build_only: Annotated[bool, typer.Option("--build-only", help="Build the firmware, touch no board.")] = False,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Build, and say what would be done.")] = False,
    genome_only: Annotated[
        bool, typer.Option("--genome-only", help="Only the genome, into a board that has the firmware.")
    ] = False,
) -> None:
    """Put a controller on a board, and say what is then on it.

    With --genome-only no --board is needed: the robot says what it is.

    Example: sceann flash runs/first --board uno --port /dev/ttyACM0 --autorun 50
    """
    console = Console(highlight=False, soft_wrap=True)
    if sum((header_only, build_only, dry_run, genome_only)) > 1:
        raise typer.BadParameter("give one of --header-only, --build-only, --dry-run, --genome-only")
    if on_button and autorun is None:
        raise typer.BadParameter("--on-button: expected --autorun MS beside it, the control period")
    if board == THYMIO:
        if autorun is not None or header_only or build_only or dry_run or genome_only:
            raise typer.BadParameter("--board thymio: expected --genome and --port only; its button starts it")
        reader = JournalReader(directory)
        image = load_image(reader, genome, note=_note)
        _tell(console, flash_thymio(image, journalled_config(reader).robot, port or the_only_port()))
        return
    unplugged = Unplugged()
    if autorun is not None:
        unplugged = Unplugged(StoreAction.BUTTON if on_button else StoreAction.AUTORUN, autorun / 1000.0)
    image = load_image(JournalReader(directory), genome, "--name controller --optimize speed", _note)
    if header_only:
        write_header(Path("controller.h"), c_header(image))
        console.print("controller.h written")
        return
    if genome_only:
        _tell(console, flash_genome(image, port or the_only_port(), baud, node, unplugged))
        return
    if board is None:
        raise typer.BadParameter("expected --board, or --genome-only for a robot that has the firmware")
    kind = board_named(board)
    plan = plan_flash(image, kind, port, baud, upload_baud, can)
    if build_only:
        console.print(f"firmware  {plan.image}", markup=False, soft_wrap=True)
    elif dry_run:
        alone = "" if autorun is None else f", run without a host every {autorun:g} ms"
        console.print(f"firmware  {plan.image}\nupload    {plan.shell}", markup=False, soft_wrap=True)
        way = "CAN, when a run on it begins" if can else f"{port or 'PORT'} at {baud} baud{alone}"
        console.print(f"genome    {image.record_crc:08x}, {len(image.genome)} bits, over {way}")
    elif can:
        upload_firmware(plan)
        console.print("firmware written; a configuration with `can: {interface: ..., channel: ...}` reaches it")
    else:
        port = port or the_only_port()
        _tell(console, flash(image, plan_flash(image, kind, port, baud, upload_baud), port, baud, node, unplugged))


def _note(text: str) -> None:
    typer.echo(f"note: {text}", err=True)


def _tell(console: Console, on_robot: OnRobot | str) -> None:
    console.print(f"now on the robot: {on_robot}", markup=False)


def verify_board(
    directory: RunDirectory,
    board: BoardName = None,
    genome: Genome = "best",
    port: Port = None,
    baud: Baud = BAUD,
    node: Node = 1,
    sequences: Annotated[
        int | None,
        typer.Option("--sequences", min=1, help="Random sensor sequences.", show_default="1000; 120 on a Thymio"),
    ] = None,
    steps: Annotated[int, typer.Option("--steps", min=1, max=65535, help="Control steps in each.")] = 20,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the random sequences.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Prove that a board computes what the simulator computed: every state of every neuron.

    With --port the robot there, whatever board it is; otherwise --board is emulated. Random sensors, and those of the
    individual's own trials.

    Example: sceann verify runs/first --board uno
    """
    if board is None and port is None:
        raise typer.BadParameter("expected --port (a robot) or --board (to be emulated)")
    kind = board_named(board) if board not in (None, THYMIO) else None
    reader = JournalReader(directory)
    image, recorded = load_image(reader, genome, note=_note), recorded_sensors(reader, genome)
    count = sequences or (120 if board == THYMIO else 1000)
    generated = random_sequences(np.random.default_rng(seed), count, steps, image.size.n_sensors)
    everything = chain(recorded, generated)
    place = port or f"the {'simulated' if board == THYMIO else 'emulated'} {board}"
    with Progress(transient=True, disable=as_json) as progress:
        bar = progress.add_task(f"verifying on {place}", total=count + len(recorded))

        def done(number: int) -> None:
            progress.update(bar, completed=number)

        try:
            if board == THYMIO:
                result = verify_thymio(image, journalled_config(reader).robot, port, everything, done)
            else:
                with _link(kind, port, baud, node) as link:
                    result = verify(link, image, everything, place, done)
        except LinkError as error:
            raise RobotUnreachable(f"{place}: {error}.", "Check power, cable and port, then verify again.") from None
    if as_json:
        difference = None if result.difference is None else str(result.difference)
        print_json(
            {
                "board": board,
                "place": place,
                "equal": result.equal,
                "sequences": result.sequences,
                "recorded_sequences": len(recorded),
                "steps": result.steps,
                "states": result.states,
                "difference": difference,
            }
        )
    if result.difference is not None:
        raise VerifyDiffers(
            f"{place} does not compute what the reference computes: {result.difference}.",
            "Build and flash the firmware again; if it stays, this is a bug that we want to hear of.",
        )
    if not as_json:
        counts = (
            f"{result.states} states, {result.steps} steps, {result.sequences} sequences ({len(recorded)} recorded)"
        )
        Console(highlight=False, soft_wrap=True).print(f"{place}: every state is equal. {counts}")


def set_node(
    new_node: Annotated[int, typer.Argument(metavar="NEW", min=1, max=127, help="Its number from now on.")],
    port: Port = None,
    baud: Baud = BAUD,
    node: Node = 1,
) -> None:
    """Give a robot a node number of its own; it keeps it without power.

    Two robots with one number obey every command together. Have only one of them switched on.

    Example: sceann set-node 2 --port /dev/ttyACM0
    """
    place = port or the_only_port()
    with opened(place, baud, node) as link:
        descriptor = handshake(link, place)
        try:
            link.request(Op.NODE, node_arguments(new_node))
        except Refused as refused:
            advice = "Only a robot with a store keeps a number."
            if refused.status is Status.BAD_STATE:
                advice = "It runs a trial or was stopped: see that it is safe, then let `sceann doctor` put it to rest."
            raise RobotUnreachable(f"{place}: {refused}.", advice) from None
    Console(highlight=False, soft_wrap=True).print(
        f"{descriptor.name} ({descriptor.unique_id:014x}) is node {new_node}"
    )


@contextmanager
def _link(board: Board | None, port: str | None, baud: int, node: int) -> Iterator[RobotLink]:
    if port is not None or board is None:
        with opened(port or the_only_port(), baud, node) as link:
            yield link
        return
    try:
        from sceann_hil.firmware.emulated.lines import emulated_line
    except ImportError as error:
        raise FirmwareBuildFailed(f"emulation: {error}", "Install sceann-hil with its backends.") from None
    with emulated_line(board) as line:
        link = RobotLink(LineBus(line, board.value))
        try:
            yield link
        finally:
            link.close()

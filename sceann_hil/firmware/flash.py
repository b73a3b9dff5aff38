"""A controller onto a board: build, upload with the board's usual tool, then ask the board what is on it."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from sceann_hil.errors import FirmwareBuildFailed, FlashFailed, ToolMissing
from sceann_hil.firmware.build import AVR, TOOLCHAINS, Board, build_board, find_tool
from sceann_hil.firmware.uf2 import uf2
from sceann_hil.link.descriptor import Capability, Descriptor
from sceann_hil.link.messages import store_arguments
from sceann_hil.link.numbers import FIRMWARE_VERSION, MAX_MOTORS, MAX_SENSORS
from sceann_hil.link.ports import PortProblem
from sceann_hil.link.serial_bus import BAUD, SceannSerialBus
from sceann_hil.link.session import NoAnswer, Refused, RobotLink
from sceann_hil.link.upload import upload_image
from sceann_hil.link.vocabulary import Op, Status, StoreAction
from sceann_hil.network.image import ControllerImage
from sceann_hil.robot import LinkError, RobotFault

UNO_SENSORS = range(1, 7)
UNO_MOTORS = 2
START_S = 6.0
"""How long a robot may take to answer: opening its port resets an Arduino, whose boot loader waits first."""


@dataclass(frozen=True, slots=True)
class FlashPlan:
    """Everything that will be done to a board, before it is done.

    Attributes:
        board: which kind.
        image: the firmware, an ELF file.
        upload: the command that writes it.
        package: the Debian package of the tool in `upload`.
    """

    board: Board
    image: Path
    upload: tuple[str, ...]
    package: str

    @property
    def shell(self) -> str:
        """The upload as a line for a shell."""
        return shlex.join(self.upload)


@dataclass(frozen=True, slots=True)
class OnRobot:
    """What is on a robot now.

    Attributes:
        descriptor: what it says that it is.
        genome_crc: CRC-32 of the genome record it uses.
        stored: the genome survives power loss.
        unplugged: what it does without a host.
    """

    descriptor: Descriptor
    genome_crc: int
    stored: bool
    unplugged: StoreAction = StoreAction.KEEP

    def __str__(self) -> str:
        d = self.descriptor
        version = ".".join(map(str, d.firmware))
        kept = "kept over power loss" if self.stored else "until it is switched off"
        kept += {
            StoreAction.AUTORUN: ", run 3 s after it is switched on",
            StoreAction.BUTTON: ", run when its start button is pressed",
        }.get(self.unplugged, "")
        return (
            f"{d.name} ({d.unique_id:014x}): firmware {version}, link {d.link_version}, "
            f"arithmetic {d.arithmetic_id:08x}, genome {self.genome_crc:08x}, {kept}"
        )


def check_size(image: ControllerImage) -> None:
    """Refuses a network that no board takes over the link.

    Raises:
        FirmwareBuildFailed: too many sensors or motors.
    """
    size = image.size
    for what, got, most in (("sensors", size.n_sensors, MAX_SENSORS), ("motors", size.n_motors, MAX_MOTORS)):
        if got > most:
            raise FirmwareBuildFailed(
                f"genome: expected at most {most} {what} over the link, got {got}.",
                "`sceann export` makes a header of any size.",
            )


def firmware_flags(image: ControllerImage, board: Board, baud: int = BAUD) -> tuple[str, ...]:
    """What the board's firmware is built with for this network.

    Raises:
        FirmwareBuildFailed: the board has not so many inputs, or another number of motors.
    """
    check_size(image)
    size = image.size
    if board is not Board.UNO:
        return ()
    if size.n_sensors not in UNO_SENSORS or size.n_motors != UNO_MOTORS:
        raise FirmwareBuildFailed(
            f"genome: expected 1 to 6 sensors and 2 motors for a uno, got {size.n_sensors} and {size.n_motors}.",
            "Evolve for this robot, or try the genome in HIL mode (sceann verify --board uno).",
        )
    return (f"-DSCEANN_UNO_SENSORS={size.n_sensors}u", f"-DBAUD={baud}UL")


UPLOAD_BAUDS = (115_200, 57_600)
"""Of boot loaders: Unos and newer Nanos, older Nanos and many clones."""


def plan_flash(
    image: ControllerImage, board: Board, port: str | None, baud: int = BAUD, upload_baud: int = UPLOAD_BAUDS[0]
) -> FlashPlan:
    """Builds the firmware and says how it would be uploaded.

    Args:
        image: the controller; decides how many inputs the firmware reads.
        board: which board.
        port: serial port, for boards that are flashed through it.
        baud: speed of the link that the uno's firmware is built for.
        upload_baud: speed of the uno's boot loader.

    Raises:
        FirmwareBuildFailed, ToolMissing: it cannot be built.
    """
    elf = build_board(board, firmware_flags(image, board, baud))
    match board:
        case Board.UNO:
            hexfile = elf.with_suffix(".hex")
            objcopy = find_tool("avr-objcopy", AVR.package)
            subprocess.run([objcopy, "-O", "ihex", "-R", ".eeprom", str(elf), str(hexfile)], check=True)
            options = ("-c", "arduino", "-p", "m328p", "-P", port or "PORT", "-b", str(upload_baud), "-D")
            return FlashPlan(board, elf, ("avrdude", *options, "-U", f"flash:w:{hexfile}:i"), "avrdude")
        case Board.STM32F405 if shutil.which("openocd") is None and shutil.which("st-flash") is not None:
            binary = elf.with_suffix(".bin")
            objcopy = find_tool("arm-none-eabi-objcopy", TOOLCHAINS[board].package)
            subprocess.run([objcopy, "-O", "binary", str(elf), str(binary)], check=True)
            return FlashPlan(board, elf, ("st-flash", "--reset", "write", str(binary), "0x08000000"), "stlink-tools")
        case Board.PICO:
            binary = elf.with_suffix(".bin")
            objcopy = find_tool("arm-none-eabi-objcopy", TOOLCHAINS[board].package)
            subprocess.run([objcopy, "-O", "binary", str(elf), str(binary)], check=True)
            file = elf.with_suffix(".uf2")
            file.write_bytes(uf2(binary.read_bytes()))
            return FlashPlan(board, elf, ("picotool", "load", "-v", "-x", str(file)), "picotool")
        case Board.STM32F405 | Board.LM3S6965 | Board.MICROBIT:
            scripts = {
                Board.MICROBIT: ("-f", "interface/cmsis-dap.cfg", "-f", "target/nrf51.cfg"),
                Board.STM32F405: ("-f", "interface/stlink.cfg", "-f", "target/stm32f4x.cfg"),
                Board.LM3S6965: (
                    "-f",
                    "board/ek-lm3s6965.cfg",
                ),
            }
            # in braces, as openocd takes paths with spaces
            program = f"program {{{elf}}} verify reset exit"
            return FlashPlan(board, elf, ("openocd", *scripts[board], "-c", program), "openocd")
        case Board.POSIX:
            raise ToolMissing(
                "board: a posix board is a program on this computer, there is nothing to flash.",
                "`sceann virtual` starts one; `sceann flash --genome-only --port PORT` loads a genome into it.",
            )


def upload_firmware(plan: FlashPlan) -> None:
    """Runs the upload tool; a boot loader that does not answer at one speed is tried at the other.

    Raises:
        ToolMissing: it is not installed.
        FlashFailed: it reports an error; the message holds its last lines.
    """
    tool = find_tool(plan.upload[0], plan.package)
    said: list[str] = []
    for command in _ways(plan.upload):
        words = _uploaded(tool, (*command, *_FEW_ATTEMPTS) if "-b" in command else command)
        if any(unknown in words for unknown in _OLD_AVRDUDE):
            words = _uploaded(tool, command)
        if not words:
            return
        said.append(words)
        if not any(silence in words for silence in _NO_BOOT_LOADER):
            break
    tried = f" (tried at {' and '.join(map(str, UPLOAD_BAUDS))} baud)" if len(said) > 1 else ""
    raise FlashFailed(
        f"{plan.upload[0]} could not write the board{tried}:\n{said[0]}",
        f"Check board, port and cable, then try it by hand: {plan.shell}",
    )


_FEW_ATTEMPTS = ("-x", "attempts=2")
"""Of avrdude, which takes six seconds for each; it makes ten by itself."""
_OLD_AVRDUDE = ("invalid extended parameter", "unable to parse extended parameter")
"""What an avrdude before 7.1 says of that."""
_NO_BOOT_LOADER = ("not in sync", "not responding")


def _ways(upload: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """The command, then the same at the other speeds of boot loaders."""
    yield upload
    if "-b" in upload:
        at = upload.index("-b") + 1
        for speed in map(str, UPLOAD_BAUDS):
            if speed != upload[at]:
                yield (*upload[:at], speed, *upload[at + 1 :])


def _uploaded(tool: str, command: tuple[str, ...]) -> str:
    """The last lines of what the tool said; empty if it succeeded."""
    done = subprocess.run([tool, *command[1:]], capture_output=True, text=True, check=False)
    if done.returncode == 0:
        return ""
    return "\n".join((done.stderr or done.stdout).strip().splitlines()[-8:]) or f"exit status {done.returncode}"


@dataclass(frozen=True, slots=True)
class Unplugged:
    """What a robot does with the genome when no host is there.

    Attributes:
        action: keep it, run it after the start, or run it when the start button is pressed.
        tick_s: control period.
    """

    action: StoreAction = StoreAction.KEEP
    tick_s: float = 0.0


def handshake(link: RobotLink, place: str) -> Descriptor:
    """Take the robot, and say what is wrong when there is none of ours.

    Raises:
        FlashFailed: silence, another firmware, another version, or another host in charge.
    """
    try:
        return link.hello(START_S)
    except LinkError as error:
        raise FlashFailed(f"{place}: {error}.", "Check power, cable, port and --baud; `sceann flash` first.") from None


def upload_genome(link: RobotLink, image: ControllerImage, place: str, unplugged: Unplugged = Unplugged()) -> OnRobot:
    """Meets the robot, gives it the genome, has it stored where it has a store, and asks what is there now.

    Nothing is half-written: the robot uses and keeps the old genome until all of the new one has arrived.

    Raises:
        FlashFailed: no robot of ours, it refuses, or what it holds is not what was sent.
    """
    check_size(image)
    descriptor = handshake(link, place)
    if descriptor.firmware != FIRMWARE_VERSION:
        raise FlashFailed(
            f"{place}: expected firmware {FIRMWARE_VERSION}, the robot has {descriptor.firmware}.", "Flash the board."
        )
    if unplugged.action is not StoreAction.KEEP:
        _check_unplugged(descriptor, image, unplugged, place)
    try:
        upload_image(link, image)
        if not descriptor.capabilities & Capability.STORE:
            return OnRobot(descriptor, image.record_crc, stored=False)
        link.request(Op.STORE, store_arguments(unplugged.action, unplugged.tick_s))
        stored = link.request(Op.STORED).u32()
    except Refused as refused:
        advice = {
            Status.TOO_LARGE: f"This robot takes at most {descriptor.max_sources} sources; evolve a smaller network.",
            Status.BAD_STATE: "It runs a trial or was stopped: wait, or CLEAR it, then try again.",
            Status.STORE_FAILED: "Its memory does not hold what is written; the genome in use before is still stored.",
        }
        raise FlashFailed(f"{place}: {refused}.", advice.get(refused.status, "")) from None
    except NoAnswer as silence:
        raise FlashFailed(f"{place}: {silence}. The robot keeps its old genome.", "Try again.") from None
    except (LinkError, RobotFault) as error:
        raise FlashFailed(f"{place}: {error}.", "Check the cable, then try again.") from None
    if stored != image.record_crc:
        raise FlashFailed(f"{place}: expected genome {image.record_crc:08x} in the store, found {stored:08x}.")
    return OnRobot(descriptor, stored, stored=True, unplugged=unplugged.action)


def _check_unplugged(robot: Descriptor, image: ControllerImage, unplugged: Unplugged, place: str) -> None:
    """Refuse before anything is sent what the robot would refuse afterwards.

    Raises:
        FlashFailed: it cannot run this network by itself.
    """
    if Capability.AUTORUN not in robot.capabilities:
        raise FlashFailed(f"{place}: --autorun: {robot.name} cannot run without a host.", "Leave --autorun out.")
    if unplugged.action is StoreAction.BUTTON and Capability.BUTTON not in robot.capabilities:
        raise FlashFailed(
            f"{place}: {robot.name} has no start button.", "Leave --on-button out: it then starts by itself."
        )
    try:
        image.size.check_fits(robot.n_sensors, robot.n_motors, robot.name)
    except ValueError as error:
        raise FlashFailed(
            f"{place}: {error}.", "Evolve for this robot, or flash firmware for as many sensors."
        ) from None
    if not robot.tick_min_s <= unplugged.tick_s <= robot.tick_max_s:
        raise FlashFailed(
            f"{place}: --autorun: expected {robot.tick_min_s * 1e3:g} to {robot.tick_max_s * 1e3:g} ms, "
            f"got {unplugged.tick_s * 1e3:g}.",
            "Give the control period that the controller was evolved with.",
        )


@contextmanager
def opened(port: str, baud: int = BAUD, node: int = 1) -> Iterator[RobotLink]:
    """The link to a robot on a serial port.

    Raises:
        FlashFailed: the port cannot be opened.
    """
    try:
        bus = SceannSerialBus(port, baud)
    except PortProblem as problem:
        raise FlashFailed(problem.message, problem.hint) from None
    link = RobotLink(bus, node)
    try:
        yield link
    finally:
        link.close()


def flash(
    image: ControllerImage,
    plan: FlashPlan,
    port: str,
    baud: int = BAUD,
    node: int = 1,
    unplugged: Unplugged = Unplugged(),
) -> OnRobot:
    """Uploads firmware and genome, and reads back what is on the board, which keeps its node number.

    Raises:
        ToolMissing, FlashFailed: see `upload_firmware` and `upload_genome`.
    """
    upload_firmware(plan)
    return flash_genome(image, port, baud, node, unplugged)


def flash_genome(
    image: ControllerImage, port: str, baud: int = BAUD, node: int = 1, unplugged: Unplugged = Unplugged()
) -> OnRobot:
    """The fast way: only the genome, over the link, into a robot that has the firmware already.

    Raises:
        FlashFailed: see `upload_genome`.
    """
    with opened(port, baud, node) as link:
        return upload_genome(link, image, port, unplugged)

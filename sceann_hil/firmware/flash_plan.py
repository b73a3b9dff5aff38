"""The firmware onto a board: built for its network, written by the board's usual tool."""

from __future__ import annotations

import shlex
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sceann_hil.errors import FirmwareBuildFailed, FlashFailed, ToolMissing
from sceann_hil.firmware.build import AVR, TOOLCHAINS, Board, build_board, find_tool
from sceann_hil.firmware.uf2 import uf2
from sceann_hil.link.numbers import MAX_MOTORS, MAX_SENSORS
from sceann_hil.link.serial_bus import BAUD
from sceann_hil.network.image import ControllerImage

UNO_SENSORS = range(1, 7)
UNO_MOTORS = 2


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


def firmware_flags(image: ControllerImage, board: Board, baud: int = BAUD, can: bool = False) -> tuple[str, ...]:
    """What the board's firmware is built with for this network.

    Raises:
        FirmwareBuildFailed: the board has not so many inputs, another number of motors, or no CAN.
    """
    check_size(image)
    size = image.size
    if can and board is not Board.STM32F405:
        raise FirmwareBuildFailed(f"--can: expected --board {Board.STM32F405}, got {board}: it has no CAN driver.")
    if board is not Board.UNO:
        return ("-DSCEANN_CAN=1",) if can else ()
    if size.n_sensors not in UNO_SENSORS or size.n_motors != UNO_MOTORS:
        raise FirmwareBuildFailed(
            f"genome: expected 1 to 6 sensors and 2 motors for a uno, got {size.n_sensors} and {size.n_motors}.",
            "Evolve for this robot, or try the genome in HIL mode (sceann verify --board uno).",
        )
    return (f"-DSCEANN_UNO_SENSORS={size.n_sensors}u", f"-DBAUD={baud}UL")


UPLOAD_BAUDS = (115_200, 57_600)
"""Of boot loaders: Unos and newer Nanos, older Nanos and many clones."""


def plan_flash(
    image: ControllerImage,
    board: Board,
    port: str | None,
    baud: int = BAUD,
    upload_baud: int = UPLOAD_BAUDS[0],
    can: bool = False,
) -> FlashPlan:
    """Builds the firmware and says how it would be uploaded.

    Args:
        image: the controller; decides how many inputs the firmware reads.
        board: which board.
        port: serial port, for boards that are flashed through it.
        baud: speed of the link that the uno's firmware is built for.
        upload_baud: speed of the uno's boot loader.
        can: the robot's link is on CAN, not on its serial port.

    Raises:
        FirmwareBuildFailed, ToolMissing: it cannot be built.
    """
    elf = build_board(board, firmware_flags(image, board, baud, can))
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

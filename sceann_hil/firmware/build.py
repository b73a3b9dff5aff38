"""The firmware of each board, compiled by the board's own compiler and kept in the user's cache.

An image is kept under a hash of everything that goes into it (sources, compiler version, flags), so a second build of
the same firmware costs nothing and a changed file is never missed.
"""

from __future__ import annotations

import hashlib
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from sceann_hil import derived
from sceann_hil.errors import FirmwareBuildFailed, ToolMissing

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
"""The C sources: the repository's folder ``firmware``."""

WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror")


class Board(StrEnum):
    """Boards with a port in ``firmware/boards``."""

    POSIX = "posix"
    """A Linux process: the twin that tests and virtual robots use."""
    UNO = "uno"
    """Arduino Uno and other ATmega328P boards at 16 MHz."""
    STM32F405 = "stm32f405"
    """STM32F405, also QEMU's netduinoplus2."""
    PICO = "pico"
    """Raspberry Pi Pico (RP2040), with a body of its own."""
    MICROBIT = "microbit"
    """BBC micro:bit, version 1 (nRF51822)."""
    LM3S6965 = "lm3s6965"
    """QEMU's lm3s6965evb, with an I2C EEPROM."""


THYMIO = "thymio"
"""A robot instead of a board: it has firmware of its own, and runs our programs (`sceann_hil.firmware.aesl`)."""


@dataclass(frozen=True, slots=True)
class Toolchain:
    """A compiler, how it is called for one chip, and where a user gets it.

    Attributes:
        compiler: the program's name.
        package: the Debian package that brings it.
        flags: flags of every compilation for this chip.
        link_flags: flags of the last step only.
    """

    compiler: str
    package: str
    flags: tuple[str, ...] = ()
    link_flags: tuple[str, ...] = ()

    def program(self) -> str:
        """The compiler's path.

        Raises:
            ToolMissing: it is not installed.
        """
        return find_tool(self.compiler, self.package)


_SMALL = ("-Os", "-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections")

HOST_GCC = Toolchain("gcc", "gcc libc6-dev", ("-O2",))
HOST_CLANG = Toolchain("clang", "clang", ("-O2",))
AVR = Toolchain("avr-gcc", "gcc-avr avr-libc", ("-mmcu=atmega328p", "-DF_CPU=16000000UL", *_SMALL))
"""For single functions and headers; the whole firmware adds `UNO_FLAGS`."""
UNO_FLAGS = ("-flto", "-mrelax", "-mcall-prologues")
_ARM = ("-mthumb", *_SMALL, "-ffreestanding")
_ARM_LINK = ("--specs=nano.specs", "-nostartfiles")
_ARM_PACKAGES = "gcc-arm-none-eabi libnewlib-arm-none-eabi"
CORTEX_M0 = Toolchain("arm-none-eabi-gcc", _ARM_PACKAGES, ("-mcpu=cortex-m0plus", *_ARM), _ARM_LINK)
NRF51 = Toolchain("arm-none-eabi-gcc", _ARM_PACKAGES, ("-mcpu=cortex-m0", *_ARM), _ARM_LINK)
CORTEX_M3 = Toolchain("arm-none-eabi-gcc", _ARM_PACKAGES, ("-mcpu=cortex-m3", *_ARM), _ARM_LINK)
CORTEX_M4 = Toolchain("arm-none-eabi-gcc", _ARM_PACKAGES, ("-mcpu=cortex-m4", *_ARM), _ARM_LINK)

RISCV = Toolchain(
    "riscv64-unknown-elf-gcc",
    "gcc-riscv64-unknown-elf",
    ("-march=rv32imc_zicsr", "-mabi=ilp32", "-mcmodel=medany", *_SMALL, "-ffreestanding"),
    ("-nostdlib", "-lgcc"),
)
"""32-bit RISC-V as in the ESP32-C3; for headers."""

TOOLCHAINS = {
    Board.POSIX: HOST_GCC,
    Board.UNO: AVR,
    Board.STM32F405: CORTEX_M4,
    Board.PICO: CORTEX_M0,
    Board.MICROBIT: NRF51,
    Board.LM3S6965: CORTEX_M3,
}


def find_tool(name: str, package: str) -> str:
    """Path of a program.

    Raises:
        ToolMissing: it is not installed; the message names the package.
    """
    path = shutil.which(name)
    if path is None:
        raise ToolMissing(f"{name}: this program is not installed.", f"On Debian or Ubuntu: apt-get install {package}")
    return path


def board_named(name: str) -> Board:
    """The board of this name.

    Raises:
        ToolMissing: there is none; the message lists those that exist.
    """
    try:
        return Board(name)
    except ValueError:
        known = ", ".join((*(board.value for board in Board), THYMIO))
        raise ToolMissing(
            f"board: expected one of {known}; got {name!r}.",
            "firmware/README.md tells how to write a port for another board.",
        ) from None


def compile_c(
    toolchain: Toolchain,
    sources: Sequence[Path],
    *,
    include: Sequence[Path] = (),
    flags: Sequence[str] = (),
    warnings: Sequence[str] = WARNINGS,
    suffix: str = ".elf",
) -> Path:
    """Compiles and links `sources`, or finds the result of an earlier time.

    Args:
        toolchain: the compiler.
        sources: C files.
        include: folders of headers; every header and linker script in them counts as a source.
        flags: further flags.
        warnings: warning flags; all of ours by default.
        suffix: of the result's name.

    Returns:
        The program, in the user's cache.

    Raises:
        ToolMissing: no compiler.
        FirmwareBuildFailed: it refused the sources; the message holds what it said.
    """
    program = toolchain.program()
    headers = [path for folder in include for path in sorted(folder.glob("*")) if path.suffix in (".h", ".ld")]
    command = [
        "-std=gnu99" if suffix == ".so" else "-std=c99",
        *toolchain.flags,
        *warnings,
        *flags,
        *(f"-I{folder}" for folder in include),
    ]
    digest = hashlib.sha256()
    digest.update(repr((program, Path(program).stat().st_mtime_ns, command, toolchain.link_flags)).encode())
    for path in (*sources, *headers):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    cache = derived.folder("firmware")
    result = cache / f"{digest.hexdigest()[:24]}{suffix}"
    if derived.is_sealed(result):
        return result
    with tempfile.TemporaryDirectory(dir=cache) as folder:
        fresh = Path(folder) / result.name
        done = subprocess.run(
            [program, *command, *map(str, sources), *toolchain.link_flags, "-o", str(fresh)],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise FirmwareBuildFailed(f"{toolchain.compiler} could not build the firmware:\n{done.stderr.strip()}")
        fresh.replace(result)
    derived.seal(result)
    return result


def core_sources() -> list[Path]:
    """The portable core's C files.

    Raises:
        FirmwareBuildFailed: the folder ``firmware`` is not there (sceann was not installed from its repository).
    """
    if not (FIRMWARE / "src" / "sceann_robot.c").exists():
        raise FirmwareBuildFailed(
            f"{FIRMWARE}: expected the firmware's sources here, found none.",
            "Install sceann-hil from a clone of its repository (pip install -e).",
        )
    return sorted((FIRMWARE / "src").glob("*.c"))


def build_board(board: Board, flags: Sequence[str] = ()) -> Path:
    """The whole firmware of a board.

    Returns:
        The ELF file (a program for `Board.POSIX`), in the user's cache.

    Raises:
        ToolMissing, FirmwareBuildFailed: see `compile_c`.
    """
    core = core_sources()
    folders = [FIRMWARE / "boards" / board.value]
    if board is Board.UNO:
        flags = (*UNO_FLAGS, *flags)
    if TOOLCHAINS[board].compiler == "arm-none-eabi-gcc":
        folders.append(FIRMWARE / "boards" / "cortexm")
        flags = (f"-T{folders[0] / 'memory.ld'}", f"-L{folders[1]}", *flags)
    sources = [path for folder in folders for path in sorted(folder.glob("*.c"))]
    return compile_c(
        TOOLCHAINS[board],
        [*sources, *core],
        include=[FIRMWARE / "src", *folders],
        flags=flags,
        suffix=f"-{board.value}.elf",
    )

"""An ATmega328P in this process, by simavr: exact cycles, the real drivers, the same bits every time.

Simulated time passes only inside `read` and `run`, so a test decides what happens in which cycle. Time-outs of `read`
are simulated seconds.
"""

from __future__ import annotations

import ctypes as ct
import subprocess
from functools import cache
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import FirmwareBuildFailed, ToolMissing
from sceann_hil.firmware.build import AVR, Board, Toolchain, build_board, compile_c, find_tool
from sceann_hil.robot import RobotFault

HZ = 16_000_000
CPU_DONE, CPU_CRASHED = 6, 7
POWER_ON, EXTERNAL_RESET = 0x01, 0x02
"""Bits of the chip's register MCUSR: why it started."""

SHIM = Toolchain("gcc", "gcc libc6-dev libsimavr-dev libelf-dev", ("-O2", "-shared", "-fPIC"), ("-lsimavr", "-lelf"))


@cache
def _library() -> ct.CDLL:
    source = Path(__file__).with_name("simavr_chip.c")
    try:
        path = compile_c(SHIM, [source], suffix=".so", warnings=("-Wall", "-Wextra"))
    except FirmwareBuildFailed as error:
        raise FirmwareBuildFailed(
            f"simavr: {error.message}", "On Debian or Ubuntu: apt-get install libsimavr-dev libelf-dev"
        ) from None
    library = ct.CDLL(str(path))
    chip, data, u32, u64, uint = ct.c_void_p, ct.c_char_p, ct.c_uint32, ct.c_uint64, ct.c_uint
    for name, result, arguments in (
        ("chip_new", chip, (ct.c_char_p, ct.c_int, ct.c_char_p, u32, u32, ct.c_uint8)),
        ("chip_free", None, (chip,)),
        ("chip_write", ct.c_int, (chip, data, ct.c_int)),
        ("chip_low", None, (chip, u64)),
        ("chip_reset", None, (chip, ct.c_uint8)),
        ("chip_supply", None, (chip, u32)),
        ("chip_flash", None, (chip, uint, data, uint)),
        ("chip_start_at", None, (chip, uint)),
        ("chip_read", ct.c_int, (chip, data, ct.c_int)),
        ("chip_waiting", ct.c_int, (chip,)),
        ("chip_run", ct.c_int, (chip, ct.c_int, u64)),
        ("chip_cycles", u64, (chip,)),
        ("chip_mark_at", None, (chip, uint)),
        ("chip_marked_min", u64, (chip,)),
        ("chip_marked_max", u64, (chip,)),
        ("chip_peek", None, (chip, uint, data, uint)),
        ("chip_poke", None, (chip, uint, data, uint)),
        ("chip_exchange", ct.c_int, (chip, uint, ct.c_uint8, uint, data, uint, uint, data, uint, uint, u64)),
        ("chip_hang", None, (chip,)),
        ("chip_adc", None, (chip, ct.c_int, u32)),
        ("chip_pin", None, (chip, ct.c_char, ct.c_int, ct.c_int)),
        ("chip_eeprom_size", uint, (chip,)),
        ("chip_eeprom_set", None, (chip, data, uint)),
        ("chip_eeprom_get", None, (chip, data, uint)),
    ):
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


@cache
def symbols(elf: Path) -> dict[str, int]:
    """Data addresses of an AVR program's variables, by name."""
    listing = subprocess.run(
        [find_tool("avr-nm", AVR.package), str(elf)], capture_output=True, text=True, check=True
    ).stdout
    table = {}
    for line in listing.splitlines():
        address, kind, name = line.rsplit(maxsplit=2) if line[0] != " " else ("", "", "")
        if kind in ("b", "B", "d", "D"):
            table[name] = int(address, 16) - 0x800000
    return table


class AvrChip:
    """A simulated chip with its UART 0 as a serial line.

    Args:
        image: an ELF file, or a binary one (``.bin``) that is put at `reset_pc`.
        mcu: simavr's name of the chip.
        reset_pc: where it starts, in bytes (a bootloader's place; 0 for a program).
        reset_flags: why it starts, as in MCUSR.
    """

    def __init__(self, image: Path, mcu: str = "atmega328p", reset_pc: int = 0, reset_flags: int = POWER_ON) -> None:
        self._library = _library()
        self._chip = self._library.chip_new(
            str(image).encode(), image.suffix == ".bin", mcu.encode(), HZ, reset_pc, reset_flags
        )
        if not self._chip:
            raise FirmwareBuildFailed(f"simavr cannot start {mcu} with {image.name}.")

    def close(self) -> None:
        """Ends the simulation. Nothing survives but what `eeprom` gave."""
        if self._chip:
            self._library.chip_free(self._chip)
            self._chip = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- time -------------------------------------------------------------------------------------------------------

    @property
    def cycles(self) -> int:
        """Clock cycles since the start."""
        return int(self._library.chip_cycles(self._chip))

    def now_s(self) -> float:
        """The chip's own time: it stands still while nobody reads or runs it."""
        return self.cycles / HZ

    def run(self, cycles: int, until_bytes: int = 0) -> None:
        """Lets time pass, at most until so many bytes wait to be read.

        Raises:
            RobotFault: the program crashed or stopped the chip.
        """
        state = self._library.chip_run(self._chip, until_bytes, cycles)
        if state in (CPU_DONE, CPU_CRASHED):
            raise RobotFault(f"the simulated chip {'crashed' if state == CPU_CRASHED else 'stopped'}")

    def reset(self, flags: int = EXTERNAL_RESET) -> None:
        """A reset, for the reasons in MCUSR; RAM keeps what is in it."""
        self._library.chip_reset(self._chip, flags)

    def set_supply(self, millivolts: int) -> None:
        """The voltage that the chip runs on, and that its converter compares with."""
        self._library.chip_supply(self._chip, millivolts)

    def add_program(self, at: int, data: bytes) -> None:
        """Puts more code into flash."""
        self._library.chip_flash(self._chip, at, data, len(data))

    def start_at(self, address: int) -> None:
        """Where it starts, now and after every reset."""
        self._library.chip_start_at(self._chip, address)

    def hang(self) -> None:
        """The program runs in circles from now on, deaf to interrupts: a fault that only the watchdog can end."""
        self._library.chip_hang(self._chip)

    # -- serial line ------------------------------------------------------------------------------------------------

    def write(self, data: bytes) -> None:
        """Queues bytes for the UART, which takes them at its own speed."""
        if self._library.chip_write(self._chip, data, len(data)) != len(data):
            raise RobotFault("the simulated line is full: nobody reads it")

    def send_break(self, low_s: float = 0.25) -> None:
        """A BREAK: the line is low for so long, as `tcsendbreak` does it."""
        self._library.chip_low(self._chip, int(low_s * HZ))

    def bad_stop_bit(self, baud: int = 115_200) -> None:
        """A zero byte whose stop bit is low; then the line is idle again."""
        self._library.chip_low(self._chip, int(HZ / baud / 4))

    def read(self, timeout_s: float) -> bytes:
        """What the UART has sent, after at most so many simulated seconds for the first byte."""
        if not self._library.chip_waiting(self._chip):
            self.run(int(timeout_s * HZ) + 1, until_bytes=1)
        waiting = self._library.chip_waiting(self._chip)
        buffer = ct.create_string_buffer(max(waiting, 1))
        got = self._library.chip_read(self._chip, buffer, waiting)
        return buffer.raw[:got]

    # -- memory -----------------------------------------------------------------------------------------------------

    def peek(self, address: int, n: int) -> bytes:
        """Data memory (registers included), without running."""
        buffer = ct.create_string_buffer(n)
        self._library.chip_peek(self._chip, address, buffer, n)
        return buffer.raw

    def poke(self, address: int, data: bytes) -> None:
        """Writes data memory behind the program's back."""
        self._library.chip_poke(self._chip, address, data, len(data))

    def exchange(
        self, flag: int, command: int, at_in: int, inputs: NDArray[np.uint8], at_out: int, n_out: int
    ) -> NDArray[np.uint8]:
        """For each row of `inputs`: puts it into memory, sets the flag to `command`, runs until the program clears
        the flag, and takes `n_out` bytes.

        Returns:
            shape ``(n_rows, n_out)``.
        """
        inputs = np.ascontiguousarray(inputs, np.uint8)
        rows, n_in = inputs.shape
        buffer = ct.create_string_buffer(rows * n_out)
        state = self._library.chip_exchange(
            self._chip, flag, command, at_in, inputs.tobytes(), n_in, at_out, buffer, n_out, rows, HZ
        )
        if state != 0:
            raise RobotFault(f"the simulated chip did not finish a step (state {state})")
        return np.frombuffer(buffer.raw, np.uint8).reshape(rows, n_out)

    def mark_at(self, address: int) -> None:
        """Measures from now on: cycles from a write of another value than 0 to this register until a write of 0."""
        self._library.chip_mark_at(self._chip, address)

    @property
    def marked_cycles(self) -> tuple[int, int]:
        """Least and most cycles that were measured."""
        return int(self._library.chip_marked_min(self._chip)), int(self._library.chip_marked_max(self._chip))

    @property
    def eeprom(self) -> bytes:
        """What is in the EEPROM."""
        n = self._library.chip_eeprom_size(self._chip)
        buffer = ct.create_string_buffer(n)
        self._library.chip_eeprom_get(self._chip, buffer, n)
        return buffer.raw

    @eeprom.setter
    def eeprom(self, content: bytes) -> None:
        self._library.chip_eeprom_set(self._chip, content, len(content))

    # -- pins -------------------------------------------------------------------------------------------------------

    def set_analogue(self, channel: int, value: int) -> None:
        """The voltage at an analogue input, given as the 10-bit value that the chip reads at a supply of 5 V."""
        self.set_millivolts(channel, -(-value * 5000 // 1023))

    def set_millivolts(self, channel: int, millivolts: int) -> None:
        """The voltage at an analogue input."""
        self._library.chip_adc(self._chip, channel, millivolts)

    def set_pin(self, port: str, pin: int, high: bool) -> None:
        """The level at a digital input."""
        self._library.chip_pin(self._chip, port.encode(), pin, int(high))


BOOT_LOADER = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/optiboot/optiboot_atmega328.hex")
"""Optiboot 4.4, which Unos ship with."""
BOOT_LOADER_PC = 0x7E00


@cache
def boot_loader() -> bytes:
    """The boot loader that Unos ship with.

    Raises:
        ToolMissing: it is not installed.
    """
    if not BOOT_LOADER.exists():
        raise ToolMissing(
            f"{BOOT_LOADER}: the boot loader is not there.", "On Debian or Ubuntu: apt-get install arduino-core-avr"
        )
    code = bytearray(b"\xff" * 512)
    for line in BOOT_LOADER.read_text().split():
        count, address, kind = int(line[1:3], 16), int(line[3:7], 16), int(line[7:9], 16)
        at = address - BOOT_LOADER_PC
        # Debian's build is 20 bytes too long: behind its end a chip goes on at 0, where it was to go
        if kind == 0 and at + count <= len(code):
            code[at : at + count] = bytes.fromhex(line[9 : 9 + 2 * count])
    return bytes(code)


_PORTB, _PORTD, _TCCR0A, _OCR0A, _OCR0B = 0x25, 0x2B, 0x44, 0x47, 0x48
_LIGHT = 0x20
_CONNECTED_A, _CONNECTED_B = 0x80, 0x20
_LEFT_FORWARD, _RIGHT_FORWARD = 0x80, 0x10


class UnoBoard(AvrChip):
    """The uno firmware in a simulated ATmega328P, with what hangs on its pins.

    Args:
        flags: compile-time choices (``-D...``) of ``firmware/boards/uno``.
        eeprom: what was in its EEPROM when it was switched off.
        reset_flags: why it starts.
        booted: every start goes through the boot loader that Unos ship with.
    """

    def __init__(
        self,
        flags: tuple[str, ...] = (),
        eeprom: bytes | None = None,
        reset_flags: int = POWER_ON,
        booted: bool = False,
    ) -> None:
        super().__init__(build_board(Board.UNO, flags), reset_flags=reset_flags)
        if booted:
            self.add_program(BOOT_LOADER_PC, boot_loader())
            self.start_at(BOOT_LOADER_PC)
        self.eeprom = b"\xff" * 1024 if eeprom is None else eeprom
        for switch in (0, 2, 3):
            self.set_pin("D", switch, True)
        self.set_pin("B", 0, True)

    def set_sensors(self, values: list[int]) -> None:
        """10-bit values at A0, A1, ..."""
        for channel, value in enumerate(values):
            self.set_analogue(channel, value)

    def set_bumper(self, pressed: bool) -> None:
        """The bumper's switch."""
        self.set_pin("D", 2, not pressed)

    def set_stop_button(self, pressed: bool) -> None:
        """The stop button."""
        self.set_pin("D", 3, not pressed)

    def set_start_button(self, pressed: bool) -> None:
        """The start button."""
        self.set_pin("B", 0, not pressed)

    @property
    def light(self) -> bool:
        """The board's light is on."""
        return bool(self.peek(_PORTB, 1)[0] & _LIGHT)

    @property
    def motors(self) -> tuple[int, int]:
        """PWM duty of motor 0 (left) and 1 (right) as the driver sees it, -255..255; (0, 0) is the safe output."""
        control, duty_a, duty_b, port = (self.peek(register, 1)[0] for register in (_TCCR0A, _OCR0A, _OCR0B, _PORTD))
        right = duty_b if control & _CONNECTED_B else 0
        left = duty_a if control & _CONNECTED_A else 0
        return (
            left if port & _LEFT_FORWARD else -left,
            right if port & _RIGHT_FORWARD else -right,
        )

"""What an exported header costs on a chip: flash, RAM, stack, and exact cycles or instructions of one step."""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sceann_hil.firmware.build import AVR, CORTEX_M3, FIRMWARE, Board, Toolchain, compile_c, find_tool
from sceann_hil.firmware.emulated.qemu import qemu_command
from sceann_hil.firmware.emulated.simavr import AvrChip, symbols
from sceann_hil.firmware.header import Optimize, c_header
from sceann_hil.network.image import ControllerImage

_HARNESS = Path(__file__).parent / "harness"
_GPIOR0, _STACK_PATTERN, _RAM_END = 0x3E, 0xA5, 0x900
_N_STEPS = 20_000
_NS_PER_TICK = 80
"""The LM3S6965 counts at 12.5 MHz."""


@dataclass(frozen=True, slots=True)
class Cost:
    """What one controller costs on one target.

    Attributes:
        target: the chip.
        flash_bytes: code and constants, without the program around it.
        ram_bytes: the controller's state.
        stack_bytes: deepest use of the stack during a step.
        step: clock cycles (AVR, exact) or instructions (Cortex-M) of one step.
    """

    target: str
    flash_bytes: int
    ram_bytes: int
    stack_bytes: int
    step: int


def section_sizes(image: Path, package: str, tool: str = "size") -> tuple[int, int]:
    """Bytes in flash (code, constants, initial values) and in RAM (variables) of a program."""
    done = subprocess.run([find_tool(tool, package), str(image)], capture_output=True, text=True, check=True)
    text, data, bss = (int(word) for word in done.stdout.splitlines()[1].split()[:3])
    return text + data, data + bss


def with_header(toolchain: Toolchain, harness: str, header: str, folder: Path, flags: tuple[str, ...] = ()) -> Path:
    """One of the harness programs, compiled with this header as ``net.h``."""
    (folder / "net.h").write_text(header)
    return compile_c(toolchain, [_HARNESS / harness], include=[folder], flags=flags)


def avr_cost(image: ControllerImage, optimize: Optimize, sensors: np.ndarray) -> Cost:
    """Cost on an ATmega328P.

    Args:
        image: the controller.
        optimize: which form of the header.
        sensors: wire values, shape ``(n_steps, n_sensors)``: every one of these steps is timed.

    Raises:
        ValueError: the time of a step depends on the sensors.
    """
    with tempfile.TemporaryDirectory() as name:
        folder, text = Path(name), c_header(image, "net", optimize)
        full = with_header(AVR, "header_avr.c", text, folder)
        empty = with_header(AVR, "header_avr.c", text, folder, ("-DEMPTY",))
    flash = section_sizes(full, AVR.package, "avr-size")[0] - section_sizes(empty, AVR.package, "avr-size")[0]
    mailbox = symbols(full)["mailbox"]
    rows = np.zeros((len(sensors), 12), "<u2")
    rows[:, : image.size.n_sensors] = sensors
    with AvrChip(full) as chip:
        chip.run(10_000)
        free = mailbox + 128
        chip.poke(free, bytes([_STACK_PATTERN]) * (_RAM_END - free - 16))
        chip.mark_at(_GPIOR0)
        chip.exchange(mailbox, 1, mailbox + 2, rows.view(np.uint8), mailbox + 26, 6)
        fastest, slowest = chip.marked_cycles
        untouched = chip.peek(free, _RAM_END - free)
    if fastest != slowest:
        raise ValueError(f"step: expected the same time always, got {fastest} to {slowest} cycles")
    stack = len(untouched.lstrip(bytes([_STACK_PATTERN])))
    return Cost("ATmega328P", flash, 4 * image.size.n_neurons, stack, slowest)


def _run_on_cortex_m3(header: str, flags: tuple[str, ...]) -> tuple[Path, int, int, int]:
    """The program, what the self-test says, the ticks that its steps took, and the bytes of stack that they touched."""
    boards = FIRMWARE / "boards"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        place = (f"-DN_STEPS={_N_STEPS}u", f"-T{boards / 'lm3s6965' / 'memory.ld'}", f"-L{boards / 'cortexm'}")
        program = with_header(CORTEX_M3, "header_cortexm.c", header, folder, (*flags, *place))
        extra = ["-icount", "shift=0", "-semihosting-config", "enable=on,target=native"]
        command = qemu_command(Board.LM3S6965, program, extra)
        subprocess.run(command, cwd=folder, check=True, timeout=60, stdin=subprocess.DEVNULL, capture_output=True)
        self_test, ticks, stack = np.fromfile(folder / "answers", "<u4")
    return program, int(self_test), int(ticks), int(stack)


def cortex_m3_cost(image: ControllerImage, optimize: Optimize) -> Cost:
    """Cost on a Cortex-M3, counted by QEMU: one instruction is one nanosecond of its SysTick."""
    text = c_header(image, "net", optimize)
    full, _, ticks, stack = _run_on_cortex_m3(text, ())
    empty, _, loop_ticks, loop_stack = _run_on_cortex_m3(text, ("-DEMPTY",))
    tool, package = "arm-none-eabi-size", CORTEX_M3.package
    flash = section_sizes(full, package, tool)[0] - section_sizes(empty, package, tool)[0]
    instructions = round((ticks - loop_ticks) * _NS_PER_TICK / _N_STEPS)
    return Cost("Cortex-M3", flash, 4 * image.size.n_neurons, stack - loop_stack, instructions)


def cortex_m3_self_test(image: ControllerImage, optimize: Optimize) -> int:
    """What the header's own golden steps say on a Cortex-M3: 0, or the first step that differs."""
    return _run_on_cortex_m3(c_header(image, "net", optimize), ("-DNET_SELF_TEST",))[1]

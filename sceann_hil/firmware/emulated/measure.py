"""What an exported header costs on a chip: flash, RAM, stack, and exact cycles or instructions of one step."""

from __future__ import annotations

import subprocess
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sceann_hil.firmware.build import AVR, CORTEX_M0, CORTEX_M3, FIRMWARE, RISCV, Board, Toolchain, compile_c, find_tool
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


def avr_cost(image: ControllerImage, optimize: Optimize, sensors: np.ndarray, as_function: bool = False) -> Cost:
    """Cost on an ATmega328P.

    Args:
        image: the controller.
        optimize: which form of the header.
        sensors: wire values, shape ``(n_steps, n_sensors)``: every one of these steps is timed.
        as_function: a step is a call, not part of the loop around it.

    Raises:
        ValueError: the time of a step depends on the sensors.
    """
    with tempfile.TemporaryDirectory() as name:
        folder, text = Path(name), c_header(image, "net", optimize)
        full = with_header(AVR, "header_avr.c", text, folder, ("-DAS_FUNCTION",) if as_function else ())
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


@dataclass(frozen=True, slots=True)
class _Core:
    """A processor core in QEMU, for headers only.

    Attributes:
        name: in the table.
        toolchain: its compiler.
        harness: the program around the header.
        flags: where it lies in memory.
        command: runs a program.
        size: the tool that tells section sizes.
        per_count: instructions per count of the harness.
    """

    name: str
    toolchain: Toolchain
    harness: str
    flags: tuple[str, ...]
    size: str
    per_count: int

    def command(self, program: Path) -> list[str]:
        """What runs it."""
        extra = ["-icount", "shift=0", "-semihosting-config", "enable=on,target=native"]
        if self.toolchain is RISCV:
            qemu = find_tool("qemu-system-riscv32", "qemu-system-misc")
            machine = ["-M", "virt", "-bios", "none", "-display", "none", "-monitor", "none", "-serial", "none"]
            return [qemu, *machine, "-kernel", str(program), *extra]
        return qemu_command(Board.LM3S6965, program, extra)


_BOARDS = FIRMWARE / "boards"
_ON_LM3S = (f"-T{_BOARDS / 'lm3s6965' / 'memory.ld'}", f"-L{_BOARDS / 'cortexm'}")
_M3 = _Core("Cortex-M3", CORTEX_M3, "header_cortexm.c", _ON_LM3S, "arm-none-eabi-size", _NS_PER_TICK)
# a Cortex-M3 executes every instruction of a Cortex-M0+
_M0 = _Core("Cortex-M0+", CORTEX_M0, "header_cortexm.c", _ON_LM3S, "arm-none-eabi-size", _NS_PER_TICK)
_RV32 = _Core("RV32IMC", RISCV, "header_riscv.c", (f"-T{_HARNESS / 'riscv.ld'}",), "riscv64-unknown-elf-size", 1)


def plain_float(image: ControllerImage) -> str:
    """The controller as somebody writes it who has not thought of integers: the yardstick of the table."""
    size, weights = image.size, image.weights
    rows = ", ".join("{" + ", ".join(map(str, row)) + "}" for row in weights.tolist())
    return f"""#include <math.h>
#include <stdint.h>
#define NET_NEURONS {size.n_neurons}
#define NET_SOURCES {size.n_sources}
typedef struct {{ float u[NET_NEURONS], x[NET_NEURONS]; }} net_t;
static const float net_weights[NET_NEURONS][NET_SOURCES] = {{ {rows} }};
static inline void net_reset(net_t *c)
{{
    for (uint8_t i = 0; i < NET_NEURONS; i++) {{ c->u[i] = 0.0f; c->x[i] = 0.5f; }}
}}
static inline void net_step(net_t *c, const uint16_t *sensors, int16_t *motors)
{{
    float source[NET_SOURCES];
    for (uint8_t j = 0; j < NET_SOURCES; j++) {{
        source[j] = j < {size.n_sensors} ? (float)sensors[j] / 1023.0f : c->x[j - {size.n_sensors}];
    }}
    for (uint8_t i = 0; i < NET_NEURONS; i++) {{
        float u = c->u[i];
        for (uint8_t j = 0; j < NET_SOURCES; j++) {{ u += net_weights[i][j] * source[j]; }}
        if (u > 8.0f || u < -8.0f) {{ u = 0.0f; }}
        c->u[i] = u;
    }}
    for (uint8_t i = 0; i < NET_NEURONS; i++) {{
        c->x[i] = 1.0f / (1.0f + expf(-c->u[i]));
        if (i >= {size.n_hidden}) {{ motors[i - {size.n_hidden}] = (int16_t)(1024.0f * c->x[i]); }}
    }}
}}
"""


def avr_float_cycles(image: ControllerImage, sensors: np.ndarray) -> int:
    """Mean cycles of a step of `plain_float` on an ATmega328P."""
    with tempfile.TemporaryDirectory() as name:
        (Path(name) / "net.h").write_text(plain_float(image))
        toolchain = replace(AVR, link_flags=("-lm",))
        program = compile_c(toolchain, [_HARNESS / "header_avr.c"], include=[Path(name)], warnings=())
    mailbox = symbols(program)["mailbox"]
    total = 0
    with AvrChip(program) as chip:
        chip.run(10_000)
        for row in sensors:
            inputs = np.zeros((1, 12), "<u2")
            inputs[0, : len(row)] = row
            chip.mark_at(_GPIOR0)
            chip.exchange(mailbox, 1, mailbox + 2, inputs.view(np.uint8), mailbox + 26, 6)
            total += chip.marked_cycles[1]
    return round(total / len(sensors))


def _run_on(core: _Core, header: str, flags: tuple[str, ...]) -> tuple[Path, int, int, int]:
    """The program, what the self-test says, the counts that its steps took, and the bytes of stack they touched."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        place = (f"-DN_STEPS={_N_STEPS}u", *core.flags)
        program = with_header(core.toolchain, core.harness, header, folder, (*flags, *place))
        command = core.command(program)
        subprocess.run(command, cwd=folder, check=True, timeout=60, stdin=subprocess.DEVNULL, capture_output=True)
        self_test, counts, stack = np.fromfile(folder / "answers", "<u4")
    return program, int(self_test), int(counts), int(stack)


def _cost_on(core: _Core, image: ControllerImage, optimize: Optimize) -> Cost:
    text = c_header(image, "net", optimize)
    full, _, counts, stack = _run_on(core, text, ())
    empty, _, loop_counts, loop_stack = _run_on(core, text, ("-DEMPTY",))
    package = core.toolchain.package
    flash = section_sizes(full, package, core.size)[0] - section_sizes(empty, package, core.size)[0]
    instructions = round((counts - loop_counts) * core.per_count / _N_STEPS)
    return Cost(core.name, flash, 4 * image.size.n_neurons, stack - loop_stack, instructions)


def cortex_m3_cost(image: ControllerImage, optimize: Optimize) -> Cost:
    """Cost on a Cortex-M3, counted by QEMU: one instruction is one nanosecond of its SysTick."""
    return _cost_on(_M3, image, optimize)


def cortex_m0_cost(image: ControllerImage, optimize: Optimize) -> Cost:
    """Cost of the instructions that a Cortex-M0+ has, counted by QEMU."""
    return _cost_on(_M0, image, optimize)


def riscv_cost(image: ControllerImage, optimize: Optimize) -> Cost:
    """Cost on a 32-bit RISC-V core with multiplier and short instructions, counted by QEMU."""
    return _cost_on(_RV32, image, optimize)


def cortex_m3_self_test(image: ControllerImage, optimize: Optimize) -> int:
    """What the header's own golden steps say on a Cortex-M3: 0, or the first step that differs."""
    return _run_on(_M3, c_header(image, "net", optimize), ("-DNET_SELF_TEST",))[1]


def riscv_self_test(image: ControllerImage, optimize: Optimize) -> int:
    """The same on a 32-bit RISC-V core."""
    return _run_on(_RV32, c_header(image, "net", optimize), ("-DNET_SELF_TEST",))[1]

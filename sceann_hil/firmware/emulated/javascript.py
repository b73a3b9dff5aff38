"""Chips that run in JavaScript emulators: the Raspberry Pi Pico (rp2040js), and the ATmega328P a second time (avr8js).

Time passes only while somebody reads, in the chip's own microseconds.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import platformdirs

from sceann_hil.errors import ToolMissing
from sceann_hil.firmware.build import AVR, CORTEX_M0, Board, build_board, find_tool
from sceann_hil.robot import RobotFault

_HERE = Path(__file__).parent / "js"
_CHIPS = {Board.PICO: ("rp2040", "rp2040js", CORTEX_M0), Board.UNO: ("atmega328p", "avr8js", AVR)}


def modules() -> Path:
    """The folder whose ``node_modules`` has the emulators."""
    return Path(platformdirs.user_cache_dir("sceann-hil")) / "emulators"


def memory_image(board: Board, elf: Path, folder: Path) -> Path:
    """The content of flash from its beginning, as one file in `folder`."""
    objcopy = "avr-objcopy" if board is Board.UNO else "arm-none-eabi-objcopy"
    package = _CHIPS[board][2].package
    binary = folder / "flash.bin"
    subprocess.run([find_tool(objcopy, package), "-O", "binary", "-R", ".eeprom", str(elf), str(binary)], check=True)
    return binary


class JavaScriptBoard:
    """A board in an emulator that runs in Node.

    Args:
        board: `Board.PICO` or `Board.UNO`.
        elf: another program than the firmware.
        store: what its store held when it was switched off.

    Attributes:
        motors: duty at the motor driver when it was last heard, motor 0 first, in the chip's unit.
        light: the board's light is on.
        dark: its power failed (`cut_power_at`).

    Raises:
        ToolMissing: Node or the emulator is not installed.
    """

    def __init__(self, board: Board, elf: Path | None = None, store: bytes | None = None) -> None:
        kind, module, _ = _CHIPS[board]
        node = find_tool("node", "nodejs")
        if not (modules() / "node_modules" / module).is_dir():
            package = json.loads((_HERE / "package.json").read_text())["dependencies"]
            wanted = " ".join(f"{name}@{version}" for name, version in package.items())
            raise ToolMissing(
                f"{module}: this emulator is not installed.", f"npm install --prefix {modules()} {wanted}"
            )
        self.motors: tuple[int, int] = (0, 0)
        self.light = False
        self.dark = False
        self._now_us = 0.0
        self._to_chip = b""
        self._pins: dict[int, int] = {}
        self._adc: dict[int, int] = {}
        self._folder = tempfile.TemporaryDirectory(prefix="sceann-")
        image = memory_image(board, elf or build_board(board), Path(self._folder.name))
        command = [node, str(_HERE / "board.mjs"), kind, str(image), str(modules())]
        # it ends when its standard input does, and so with this process
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if store is not None:
            self._order(store=store.hex())

    def _order(self, **order: Any) -> dict[str, Any]:
        if self._process.stdin is None or self._process.stdout is None:
            raise RobotFault("the emulator has no line")
        order |= {"in": self._to_chip.hex(), "pins": self._pins, "adc": self._adc}
        self._to_chip, self._pins, self._adc = b"", {}, {}
        try:
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()
            line = self._process.stdout.readline()
        except OSError as error:
            raise RobotFault(f"the emulator is gone: {error}") from None
        if not line:
            raise RobotFault("the emulator is gone")
        answer: dict[str, Any] = json.loads(line)
        self._now_us, self.light, self.dark = answer["us"], bool(answer["light"]), answer["dark"]
        left, right = answer["motors"]
        self.motors = (left, right)
        return answer

    def now_s(self) -> float:
        """The chip's own time."""
        return self._now_us * 1e-6

    def write(self, data: bytes) -> None:
        """Queues bytes for the UART, which takes them at 115,200 baud."""
        self._to_chip += data

    def read(self, timeout_s: float) -> bytes:
        """What the UART has sent, after at most so many of the chip's seconds for the first byte."""
        return bytes.fromhex(self._order(us=timeout_s * 1e6 + 1.0)["out"])

    def run(self, seconds: float) -> bytes:
        """Lets time pass; what the UART sent meanwhile."""
        end, sent = self.now_s() + seconds, b""
        while self.now_s() < end and not self.dark:
            sent += self.read(end - self.now_s())
        return sent

    def set_pin(self, pin: int, high: bool) -> None:
        """The level at a digital input."""
        self._pins[pin] = int(high)

    def set_analogue(self, channel: int, value: int) -> None:
        """The 10-bit value at an analogue input."""
        self._adc[channel] = value

    def cut_power_at(self, operation: int) -> None:
        """The Pico's power fails in the middle of its n-th flash operation from now."""
        self._order(cut=operation)

    @property
    def store(self) -> bytes:
        """What survives without power: EEPROM, or the last sectors of flash."""
        return bytes.fromhex(self._order(dump=True)["store"])

    def close(self) -> None:
        """Switches it off."""
        if self._process.stdin is not None:
            self._process.stdin.close()
        self._process.kill()
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._folder.cleanup()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

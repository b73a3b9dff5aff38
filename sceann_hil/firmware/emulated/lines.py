"""An emulated board of any kind as a serial line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sceann_hil.firmware.build import Board
from sceann_hil.firmware.emulated.javascript import JavaScriptBoard
from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.firmware.emulated.qemu import QemuBoard
from sceann_hil.firmware.emulated.simavr import UnoBoard
from sceann_hil.link.framed_bus import Line


@contextmanager
def emulated_line(board: Board, store: Path | None = None) -> Iterator[Line]:
    """Starts the board's firmware without hardware and gives its line; the board is switched off at the end.

    Args:
        board: which one.
        store: file for what survives power loss, where the emulation can keep it (not the Uno's).

    Raises:
        ToolMissing, FirmwareBuildFailed: compiler or emulator is not installed.
    """
    match board:
        case Board.POSIX:
            with PosixBoard(store=store) as posix:
                if posix.line is not None:
                    yield posix.line
        case Board.UNO:
            with UnoBoard(("-DBAUD=500000UL",)) as uno:
                yield uno
        case Board.PICO:
            with JavaScriptBoard(board) as pico:
                yield pico
        case Board.LM3S6965:
            with QemuBoard(board, eeprom=store) as emulated:
                yield emulated.line
        case Board.STM32F405 | Board.MICROBIT:
            with QemuBoard(board) as emulated:
                yield emulated.line

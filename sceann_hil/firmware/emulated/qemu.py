"""Cortex-M boards in QEMU: the images that would be flashed, on emulated chips.

Bytes that reach an emulated UART before the firmware has enabled it are lost, on every transport, as on real boards:
a host says HELLO again when nothing comes.
"""

from __future__ import annotations

import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

from sceann_hil.errors import ToolMissing
from sceann_hil.firmware.build import Board, build_board, find_tool
from sceann_hil.firmware.emulated.sockets import SocketLine
from sceann_hil.guarded import guarded

MACHINES = {Board.LM3S6965: "lm3s6965evb", Board.STM32F405: "netduinoplus2", Board.MICROBIT: "microbit"}
EEPROM_BYTES = 4096


def qemu_command(board: Board, image: Path, extra: Sequence[str] = ()) -> list[str]:
    """The command line that runs `image` without screen and monitor.

    Raises:
        ToolMissing: QEMU is not installed.
    """
    return [
        find_tool("qemu-system-arm", "qemu-system-arm"),
        *("-M", MACHINES[board], "-display", "none", "-monitor", "none", "-kernel", str(image)),
        *extra,
    ]


def _needs_posix() -> None:
    if sys.platform == "win32":
        raise ToolMissing("Emulated boards need a POSIX system.", "Use Linux, or a board of your own.")


class QemuBoard:
    """A running emulated board.

    Attributes:
        line: the host's end of its UART.
        process: ends with QEMU, and QEMU with it (see `sceann_hil.guarded`).

    Args:
        board: one of `MACHINES`.
        eeprom: file that keeps the LM3S6965's EEPROM; made if absent. Without it that board has no store.
        image: another program than the firmware.
        extra: more arguments for QEMU.
    """

    def __init__(
        self,
        board: Board,
        *,
        eeprom: Path | None = None,
        image: Path | None = None,
        extra: Sequence[str] = (),
    ) -> None:
        arguments = list(extra)
        if eeprom is not None:
            if not eeprom.exists():
                eeprom.write_bytes(b"\xff" * EEPROM_BYTES)
            arguments += ["-drive", f"if=none,id=store,format=raw,file={eeprom}"]
            arguments += ["-device", f"at24c-eeprom,address=0x50,rom-size={EEPROM_BYTES},drive=store"]
        _needs_posix()
        host, chip = socket.socketpair()
        arguments += ["-chardev", f"socket,id=line,fd={chip.fileno()}", "-serial", "chardev:line"]
        self.line = SocketLine(host)
        command = qemu_command(board, image or build_board(board), arguments)
        self._switched_on = ExitStack()
        with chip:
            self.process = self._switched_on.enter_context(
                guarded(command, subprocess.DEVNULL, pass_fds=[chip.fileno()])
            )

    def close(self) -> None:
        """Switches the board off."""
        self._switched_on.close()
        self.line.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

"""The CAN driver of the STM32F405, as far as it goes without hardware: on a model of the controller's registers.

No emulator here has this controller. What is not tried: bit timing on a wire, arbitration, a real bus-off.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from sceann_hil.firmware.build import FIRMWARE, HOST_GCC, Board, build_board, compile_c


def test_identifiers_filters_mailboxes_and_a_dead_bus() -> None:
    board = FIRMWARE / "boards" / "stm32f405"
    sources = [Path(__file__).parent / "c" / "bxcan.c", board / "can.c"]
    program = compile_c(HOST_GCC, sources, include=[FIRMWARE / "src", board])
    done = subprocess.run([program], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0, done.stdout


def test_the_board_builds_with_its_link_on_can() -> None:
    assert build_board(Board.STM32F405, ("-DSCEANN_CAN=1",)).exists()

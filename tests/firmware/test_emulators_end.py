"""Boards without hardware end with the process that they belong to, even when that is killed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

STARTS = {
    "posix": "from sceann_hil.firmware.emulated.posix import PosixBoard as B; b = B(); pid = b.process.pid",
    "qemu": (
        "from sceann_hil.firmware.emulated.qemu import QemuBoard as B; from sceann_hil.firmware.build import Board; "
        "import subprocess; b = B(Board.LM3S6965); keeper = b.process.pid; pid = ''\n"
        "ask = ['pgrep', '-P', str(keeper), 'qemu']\n"
        "while not pid: pid = subprocess.run(ask, capture_output=True, text=True).stdout.strip()"
    ),
}


@pytest.mark.parametrize("board", STARTS)
def test_a_killed_parent_takes_its_board_with_it(board: str) -> None:
    script = f"{STARTS[board]}\nprint(pid, flush=True)\nimport time; time.sleep(60)"
    parent = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    os.kill(child, 0)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        if not _alive(child):
            return
        time.sleep(0.05)
    os.kill(child, signal.SIGKILL)
    raise AssertionError("the board outlived its parent")


def _alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False

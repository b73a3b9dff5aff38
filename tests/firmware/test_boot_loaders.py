"""avrdude against the boot loader of older Nanos, which speaks at 57,600 baud: the real one, in a simulated chip."""

from __future__ import annotations

import re
import subprocess
import termios
import threading
import time
from pathlib import Path
from types import TracebackType
from typing import Self

import pytest

from backends.virtual.virtual_uno import Socket
from sceann_hil.errors import FlashFailed
from sceann_hil.firmware.build import AVR, Board, find_tool
from sceann_hil.firmware.emulated.simavr import EXTERNAL_RESET, HZ, AvrChip
from sceann_hil.firmware.flash import flash
from sceann_hil.firmware.flash_plan import plan_flash, upload_firmware
from tests.firmware.rig import an_image

BOOT_LOADERS = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders")
OLD_NANO = BOOT_LOADERS / "atmega" / "ATmegaBOOT_168_atmega328.hex"
OLD_NANO_PC = 0x7800
UCSR0A, UBRR0L, UBRR0H, DOUBLE_SPEED = 0xC0, 0xC4, 0xC5, 0x02
SLICE_S = 0.001
SPEEDS = {getattr(termios, name): int(name[1:]) for name in dir(termios) if re.fullmatch(r"B\d+", name)}
IMAGE = an_image(n_sensors=5)


class Nano:
    """A chip behind its boot loader on a pseudo-terminal. Opening the port resets it; bytes at another speed are lost.

    Attributes:
        port: the terminal's path.
        speeds: at which the port was opened, one after another.
    """

    def __init__(self, folder: Path) -> None:
        program = folder / "boot.bin"
        objcopy = find_tool("avr-objcopy", AVR.package)
        subprocess.run([objcopy, "-I", "ihex", "-O", "binary", str(OLD_NANO), str(program)], check=True)
        self._chip = AvrChip(program, reset_pc=OLD_NANO_PC, reset_flags=EXTERNAL_RESET)
        self._socket = Socket()
        self.port = self._socket.port
        self.speeds: list[int] = []
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        origin_s = time.monotonic() - self._chip.cycles / HZ
        while not self._end.is_set():
            if self._socket.opened():
                self._chip.reset(EXTERNAL_RESET)
            sent, heard = self._socket.read(), self._chip.read(0.0)
            speed = self._host_speed()
            if sent and speed not in self.speeds[-1:]:
                self.speeds.append(speed)
            if abs(speed - self._chip_speed()) < 0.04 * speed:
                self._chip.write(sent)
                self._socket.write(heard)
            self._chip.run(int(SLICE_S * HZ))
            time.sleep(max(0.0, self._chip.cycles / HZ - (time.monotonic() - origin_s)))

    def _host_speed(self) -> int:
        return SPEEDS[termios.tcgetattr(self._socket._near)[5]]

    def _chip_speed(self) -> float:
        divider = int.from_bytes(self._chip.peek(UBRR0L, 2), "little") + 1
        return HZ / (8 if self._chip.peek(UCSR0A, 1)[0] & DOUBLE_SPEED else 16) / divider

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._end.set()
        self._thread.join()
        self._chip.close()
        self._socket.close()


def test_a_boot_loader_that_is_silent_at_one_speed_is_tried_at_the_other(tmp_path: Path) -> None:
    with Nano(tmp_path) as nano:
        on_robot = flash(IMAGE, plan_flash(IMAGE, Board.UNO, nano.port), nano.port)
        assert on_robot.genome_crc == IMAGE.record_crc
        assert on_robot.descriptor.name == "uno"
        assert nano.speeds == [115_200, 57_600, 115_200]  # the link has a speed of its own


def test_the_speed_that_is_asked_for_comes_first(tmp_path: Path) -> None:
    with Nano(tmp_path) as nano:
        upload_firmware(plan_flash(IMAGE, Board.UNO, nano.port, upload_baud=57_600))
        assert nano.speeds == [57_600]


AVRDUDE = """#!/bin/sh
echo "$@" >> {log}
case "$*" in *attempts*) {new} ;; esac
case "$*" in *57600*) {slow} ;; esac
{fast}
"""
SILENT = "echo 'avrdude: stk500_getsync(): not in sync: resp=0x00' >&2; exit 1"
OLD = "echo 'avrdude: invalid extended parameter' >&2; exit 1"
WORN = "echo 'avrdude: verification error, first mismatch at byte 0x0000' >&2; exit 1"


@pytest.mark.parametrize(
    ("new", "slow", "fast", "speeds", "said"),
    [
        (OLD, "exit 0", SILENT, ["115200", "115200", "57600", "57600"], None),
        (":", SILENT, SILENT, ["115200", "57600"], "tried at 115200 and 57600 baud"),
        (":", "exit 0", WORN, ["115200"], "verification error"),
    ],
    ids=["an-old-avrdude", "nobody-there", "another-error"],
)
def test_what_avrdude_says_decides_what_is_tried(
    new: str, slow: str, fast: str, speeds: list[str], said: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = tmp_path / "log"
    program = tmp_path / "avrdude"
    program.write_text(AVRDUDE.format(log=log, new=new, slow=slow, fast=fast))
    program.chmod(0o755)
    plan = plan_flash(IMAGE, Board.UNO, "/dev/ttyACM0")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    if said is None:
        upload_firmware(plan)
    else:
        with pytest.raises(FlashFailed) as failed:
            upload_firmware(plan)
        assert said in failed.value.message
    assert [line.split("-b ")[1].split()[0] for line in log.read_text().splitlines()] == speeds

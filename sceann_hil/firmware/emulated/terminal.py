"""A simulated chip on a pseudo-terminal, in real time: for programs that want a serial port, such as avrdude."""

from __future__ import annotations

import os
import select
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from sceann_hil.firmware.emulated.pseudo_terminal import open_pseudo_terminal
from sceann_hil.firmware.emulated.simavr import HZ, AvrChip

SLICE_S = 0.001


class ChipTerminal:
    """Runs a chip in a thread of its own, no faster than a real one, with its UART on a pseudo-terminal.

    Attributes:
        port: the terminal's path.
        chip: the chip, once it runs. Only its thread may use it until `close`.

    Args:
        power_on: makes the chip; called in the thread when the first byte comes from the terminal, as opening the port
            resets an Arduino.
        deaf_s: what comes in the first so many seconds after that is lost, as a chip in reset loses it.
    """

    def __init__(self, power_on: Callable[[], AvrChip], deaf_s: float = 0.0) -> None:
        self._master, self._slave, self.port = open_pseudo_terminal()
        self.chip: AvrChip | None = None
        self._power_on = power_on
        self._deaf_s = deaf_s
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._end.is_set() and not select.select([self._master], [], [], 0.05)[0]:
            pass
        if self._end.is_set():
            return
        self.chip = self._power_on()
        began = time.monotonic()
        origin = self.chip.cycles
        while not self._end.is_set():
            lived_s = (self.chip.cycles - origin) / HZ
            ahead_s = lived_s - (time.monotonic() - began)
            if select.select([self._master], [], [], max(ahead_s, 0.0))[0]:
                data = os.read(self._master, 256)
                if lived_s >= self._deaf_s:
                    self.chip.write(data)
            self.chip.run(int(SLICE_S * HZ))
            sent = self.chip.read(0.0)
            if sent:
                os.write(self._master, sent)

    def close(self) -> None:
        """Switches the chip off."""
        self._end.set()
        self._thread.join()
        if self.chip is not None:
            self.chip.close()
        os.close(self._master)
        os.close(self._slave)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

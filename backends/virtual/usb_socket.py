"""The USB socket of an emulated Uno."""

from __future__ import annotations

import contextlib
import os
import select
import sys

from sceann_hil.firmware.emulated.pseudo_terminal import open_pseudo_terminal


class Socket:
    """The board's USB socket: a pseudo-terminal, and the DTR line that resets an Uno when somebody opens its port.

    DTR rises when a port is opened and falls when it is closed, unless whoever had it open asked for it to stay
    (HUPCL off). The chip is reset by the rise.

    Attributes:
        port: path of the terminal.
    """

    def __init__(self) -> None:
        self._near, far, path = open_pseudo_terminal(waits=False)
        self.port = str(path)
        os.close(far)
        if sys.platform != "win32":
            self._poll = select.poll()
            self._poll.register(self._near, select.POLLIN)
        self._open = self._high = False

    def opened(self) -> bool:
        """DTR has risen since the last call: somebody plugged in."""
        if sys.platform == "win32":
            return False
        # POSIX only
        import termios

        is_open = not any(events & select.POLLHUP for _, events in self._poll.poll(0))
        rose = False
        if is_open and not self._open:
            rose, self._high = not self._high, True
        elif self._open and not is_open:
            self._high = not termios.tcgetattr(self._near)[2] & termios.HUPCL
        self._open = is_open
        return rose

    def read(self) -> bytes:
        """What the host has sent."""
        if self._open:
            with contextlib.suppress(OSError):
                return os.read(self._near, 256)
        return b""

    def write(self, data: bytes) -> None:
        """To the host; lost when nobody has the port open or reads."""
        if self._open:
            with contextlib.suppress(OSError):
                os.write(self._near, data)

    def close(self) -> None:
        """Unplug."""
        os.close(self._near)

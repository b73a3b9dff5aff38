"""A robot on a serial port as a python-can interface: ``can.Bus(interface="sceann_serial", channel="/dev/ttyACM0")``.

python-can's viewer, loggers and players work on it like on any CAN adapter. The channel is whatever
``serial.serial_for_url`` takes: a device, ``socket://host:port``, ``rfc2217://host:port``, ``loop://``.
"""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Sequence
from typing import Any

import can
import serial
from can.typechecking import AutoDetectedConfig

from sceann_hil.link.framed_bus import FramedBus
from sceann_hil.link.framing import DELIMITER
from sceann_hil.link.ports import port_problem, serial_ports

BAUD = 115_200
WRITE_TIMEOUT_S = 0.2


class SceannSerialBus(FramedBus):
    """A serial port as a bus; see `FramedBus`.

    Args:
        channel: serial device or pyserial URL.
        bitrate: baud.
        **kwargs: what every python-can bus takes, such as ``can_filters``.

    Raises:
        PortProblem: the port cannot be opened; the message says why, and what to do.
    """

    def __init__(self, channel: str, bitrate: int = BAUD, **kwargs: Any) -> None:
        try:
            self._port = serial.serial_for_url(
                channel, baudrate=bitrate, timeout=0.0, write_timeout=WRITE_TIMEOUT_S, do_not_open=True
            )
            if "://" not in channel:
                self._port.exclusive = True
            self._port.open()
        except (OSError, ValueError) as error:
            raise port_problem(channel, error) from error
        if sys.platform != "win32":
            # adapters with an FTDI chip collect bytes for 16 ms unless they are told not to
            with contextlib.suppress(OSError, ValueError, AttributeError, NotImplementedError):
                self._port.set_low_latency_mode(True)
        self._leave_dtr_when_closed()
        self.channel_info = f"sceann serial {channel}"
        super().__init__(channel, **kwargs)
        self._write(DELIMITER)

    def _leave_dtr_when_closed(self) -> None:
        """Opening the port again must not reset the board: DTR falls when a port is closed, unless told not to.

        Windows has no way to say so: there an Uno is reset whenever its port is opened.
        """
        if sys.platform == "win32":
            return
        with contextlib.suppress(ImportError, OSError, io.UnsupportedOperation, AttributeError):
            import termios

            settings = termios.tcgetattr(self._port.fileno())
            settings[2] &= ~termios.HUPCL
            termios.tcsetattr(self._port.fileno(), termios.TCSANOW, settings)

    def _write(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except serial.SerialTimeoutException as error:
            raise can.CanTimeoutError(f"{self.channel_info}: the port takes no bytes") from error
        except (serial.SerialException, OSError, TypeError) as error:
            raise can.CanOperationError(f"{self.channel_info}: cannot write ({error})") from error

    def _read(self, timeout_s: float | None) -> bytes:
        """What has come; waits for the first byte."""
        try:
            waiting = self._port.in_waiting
            if waiting:
                return self._port.read(waiting)
            self._port.timeout = timeout_s
            first = self._port.read(1)
            rest = self._port.in_waiting if first else 0
            return first + self._port.read(rest) if rest else first
        except (serial.SerialException, OSError, TypeError) as error:
            # pyserial raises TypeError when another thread has closed the port
            raise can.CanOperationError(f"{self.channel_info}: cannot read ({error})") from error

    def shutdown(self) -> None:
        """Close the port. May be called twice."""
        super().shutdown()
        with contextlib.suppress(OSError):
            self._port.close()

    def fileno(self) -> int:
        """The port's file descriptor, for `select`.

        Raises:
            NotImplementedError: this kind of port has none.
        """
        try:
            return self._port.fileno()
        except io.UnsupportedOperation:
            raise NotImplementedError(f"{self.channel_info} has no file descriptor") from None

    @staticmethod
    def _detect_available_configs() -> Sequence[AutoDetectedConfig]:
        return [{"interface": "sceann_serial", "channel": port.device} for port in serial_ports()]

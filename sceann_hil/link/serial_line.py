"""A serial port as a line, and what is wrong when it cannot be one."""

from __future__ import annotations

import errno
import time
from types import TracebackType
from typing import Self

import serial
from serial.tools import list_ports

from sceann_hil.errors import FlashFailed
from sceann_hil.link.client import NoAnswer, Refused, RobotClient
from sceann_hil.link.descriptor import Descriptor
from sceann_hil.link.vocabulary import Status

BAUD = 115_200
START_S = 6.0
"""How long a robot may take to answer: opening its port resets an Arduino, whose boot loader waits first."""

SESSION_S = 1.5
"""Longer than a robot waits for a host that has gone without a word."""


class SerialLine:
    """`read` and `write` of `sceann_hil.link.client.Line` on a port that pyserial can open.

    Raises:
        FlashFailed: the port is absent, busy or may not be opened; the message says which.
    """

    def __init__(self, port: str, baud: int = BAUD) -> None:
        self.port = port
        try:
            self._serial = serial.serial_for_url(port, baudrate=baud, timeout=0.05, write_timeout=2.0, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise _port_error(port, error) from None

    def write(self, data: bytes) -> None:
        """Sends all of it."""
        try:
            self._serial.write(data)
        except (serial.SerialException, OSError):
            raise FlashFailed(f"{self.port}: the port went away.", "Check the cable.") from None

    def read(self, timeout_s: float) -> bytes:
        """What has come, waiting at most `timeout_s` for the first byte."""
        try:
            self._serial.timeout = timeout_s
            first = self._serial.read(1)
            return bytes(first + self._serial.read(self._serial.in_waiting)) if first else b""
        except (serial.SerialException, OSError):
            raise FlashFailed(f"{self.port}: the port went away.", "Check the cable.") from None

    def close(self) -> None:
        """Gives the port back."""
        self._serial.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


def _port_error(port: str, error: Exception) -> FlashFailed:
    number = getattr(error, "errno", None)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return FlashFailed(f"{port}: there is no such port.", f"Ports now: {describe_ports()}")
    if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in str(error):
        return FlashFailed(f"{port}: another program has the port open.", "Close it (a serial monitor?) and try again.")
    if number in (errno.EACCES, errno.EPERM):
        return FlashFailed(
            f"{port}: you may not open this port.", "Add yourself to its group: usermod -aG dialout USER"
        )
    return FlashFailed(f"{port}: the port cannot be opened: {error}.", f"Ports now: {describe_ports()}")


def describe_ports() -> str:
    """The serial ports of this computer as one line of text."""
    ports = [f"{port.device} ({port.description})" for port in list_ports.comports()]
    return ", ".join(ports) if ports else "none; is the board plugged in?"


def the_only_port() -> str:
    """The port to use when the user names none.

    Raises:
        FlashFailed: there is none, or more than one.
    """
    ports = list_ports.comports()
    if len(ports) != 1:
        raise FlashFailed("--port: which one?", f"Ports now: {describe_ports()}")
    return str(ports[0].device)


def meet(client: RobotClient, place: str) -> Descriptor:
    """Takes the robot, and says what is wrong when there is none of ours.

    Raises:
        FlashFailed: silence, another firmware, another version, or another host in charge.
    """
    began = time.monotonic()
    deadline = began + START_S
    while True:
        try:
            return client.hello()
        except Refused as refused:
            if refused.status is Status.OTHER_HOST and time.monotonic() < began + SESSION_S:
                time.sleep(0.2)
                continue
            raise _refusal(place, refused) from None
        except NoAnswer:
            if time.monotonic() < deadline:
                continue
        if client.frames_received:
            raise FlashFailed(f"{place}: a robot sends, but does not answer.", "Check the line towards the robot.")
        if client.bytes_received:
            raise FlashFailed(
                f"{place}: something else than sceann's firmware sends here ({client.bytes_received} bytes, no frame).",
                "Flash the board (sceann flash), or give the right --baud.",
            )
        raise FlashFailed(f"{place}: silence.", "Check power, cable and port; a new board has to be flashed first.")


def _refusal(place: str, refused: Refused) -> FlashFailed:
    match refused.status:
        case Status.OTHER_HOST:
            return FlashFailed(f"{place}: another host is in charge of this robot.", "Stop the other program first.")
        case Status.LINK_VERSION:
            got = refused.reply["LinkVersion"]
            return FlashFailed(f"{place}: expected link version 1, the robot has {got}.", "Flash the board.")
        case Status.ARITHMETIC:
            got = refused.reply["ArithmeticId"]
            return FlashFailed(f"{place}: the robot computes with another arithmetic ({got:08x}).", "Flash the board.")
        case _:
            return FlashFailed(f"{place}: {refused}.")

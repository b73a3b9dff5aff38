"""A line to Aseba nodes: a serial port (USB or the wireless dongle) or TCP, and the messages on it.

The messages are those of the package thymiodirect (``thymiodirect.message``), an extra of this package. Its connection
is not used: it asks for variables every so often in threads of its own, which end with the process only; here a robot
tells by events, and nothing runs but the caller.
"""

from __future__ import annotations

import socket
import threading
import time
from typing import Any, Protocol

import serial

from sceann_hil.errors import PackageMissing
from sceann_hil.link.ports import port_problem
from sceann_hil.robot import LinkError

Message = Any
"""A message of thymiodirect, which has no types."""

HOST_NODE = 0
"""The number by which a host signs its messages."""
HEADER = 6
LONGEST = 600
"""Bytes of a message; Aseba allows 518."""
DEFAULT_PORT = 33333
BAUD = 115_200
_ADVICE = "another program has taken the robot (Thymio Suite, Aseba Studio), or it, or its simulator, was switched off"


def messages() -> Any:
    """The message class of thymiodirect.

    Raises:
        PackageMissing: the extra is not installed.
    """
    try:
        from thymiodirect.message import Message
    except ImportError:
        raise PackageMissing(
            "robot.type thymio needs the package thymiodirect, which is not installed.",
            "pip install 'sceann-hil[thymio]'",
        ) from None
    return Message


class Wire(Protocol):
    """Bytes in both directions."""

    def read(self, timeout_s: float) -> bytes:
        """What has come, at the latest after `timeout_s`; empty if nothing. OSError where it is gone."""

    def write(self, data: bytes) -> None:
        """All of it. OSError where it is gone."""

    def close(self) -> None:
        """May be called twice."""


class TcpWire:
    """A TCP connection.

    Args:
        host: name and port, ``name:33333`` or ``name``.
    """

    def __init__(self, host: str) -> None:
        name, _, port = host.partition(":")
        self._socket = socket.create_connection((name, int(port or DEFAULT_PORT)), timeout=3.0)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def read(self, timeout_s: float) -> bytes:
        self._socket.settimeout(max(timeout_s, 1e-4))
        try:
            data = self._socket.recv(4096)
        except TimeoutError:
            return b""
        if not data:
            raise ConnectionResetError("the connection was closed")
        return data

    def write(self, data: bytes) -> None:
        self._socket.sendall(data)

    def close(self) -> None:
        self._socket.close()


class SerialWire:
    """A serial port, held by this program alone.

    Args:
        port: path or pyserial URL.
    """

    def __init__(self, port: str) -> None:
        self._serial = serial.serial_for_url(port, BAUD, write_timeout=1.0, do_not_open=True)
        if "://" not in port:
            self._serial.exclusive = True
        self._serial.open()

    def read(self, timeout_s: float) -> bytes:
        self._serial.timeout = timeout_s
        first = self._serial.read(1)
        self._serial.timeout = 0
        return bytes(first + self._serial.read(4096)) if first else b""

    def write(self, data: bytes) -> None:
        self._serial.write(data)

    def close(self) -> None:
        self._serial.close()


class AsebaLine:
    """Messages on a wire. One thread at a time receives; any thread may send, at any time.

    Args:
        port: serial port; or
        host: name and port of a TCP connection.

    Attributes:
        place: what to call it in messages for people.
        messages: thymiodirect's message class, with the numbers of all kinds.

    Raises:
        PackageMissing: the extra is not installed.
    """

    def __init__(self, port: str | None, host: str | None) -> None:
        self.place = port if port is not None else f"{host}"
        self._port, self._host = port, host
        self.messages = messages()
        self._wire: Wire | None = None
        self._heard = bytearray()
        self._sending = threading.Lock()

    @property
    def is_open(self) -> bool:
        """There is a wire."""
        return self._wire is not None

    def open(self) -> None:
        """Open it, or open it again.

        Raises:
            LinkError: it cannot be opened; the message says why.
        """
        self.close()
        try:
            self._wire = SerialWire(self._port) if self._port is not None else TcpWire(str(self._host))
        except (OSError, ValueError) as error:
            raise LinkError(self._why_not(error)) from error

    def _why_not(self, error: Exception) -> str:
        if self._port is not None:
            return str(port_problem(self._port, error))
        advice = " Is the simulator, or the switch, running there?" if isinstance(error, ConnectionRefusedError) else ""
        return f"{self.place}: the robot cannot be reached: {error}.{advice}"

    def close(self) -> None:
        """Give it back; may be called twice."""
        if self._wire is not None:
            self._wire.close()
        self._wire = None
        self._heard.clear()

    def send(self, kind: int, *words: int) -> None:
        """Send one message of 16-bit words.

        Raises:
            LinkError: the line is gone.
        """
        message = self.messages
        payload = message.uint16array_to_bytes([word & 0xFFFF for word in words])
        data = message(kind, HOST_NODE, payload).serialize()
        wire = self._wire
        try:
            if wire is None:
                raise ConnectionError("it is not connected")
            with self._sending:
                wire.write(data)
        except (OSError, serial.SerialException) as error:
            raise LinkError(f"{self.place}: the robot is gone: {error}; {_ADVICE}") from error

    def receive(self, timeout_s: float) -> Message | None:
        """The next message, decoded; None if none came in time.

        Raises:
            LinkError: the line is gone, or what comes is not Aseba.
        """
        until_s = time.monotonic() + timeout_s
        while (message := self._complete()) is None:
            left_s = until_s - time.monotonic()
            try:
                if self._wire is None:
                    raise ConnectionError("it is not connected")
                self._heard += self._wire.read(max(left_s, 0.0))
            except (OSError, serial.SerialException) as error:
                raise LinkError(f"{self.place}: the robot is gone: {error}; {_ADVICE}") from error
            if left_s <= 0.0 and len(self._heard) < HEADER:
                return None
            if left_s <= 0.0:
                return self._complete()
        return message

    def _complete(self) -> Message | None:
        heard = self._heard
        if len(heard) < HEADER:
            return None
        length = int.from_bytes(heard[0:2], "little")
        if length > LONGEST:
            raise LinkError(f"{self.place}: what answers there does not speak Aseba (a message of {length} bytes)")
        if len(heard) < HEADER + length:
            return None
        source, kind = int.from_bytes(heard[2:4], "little"), int.from_bytes(heard[4:6], "little")
        message = self.messages(kind, source, bytes(heard[HEADER : HEADER + length]))
        del heard[: HEADER + length]
        try:
            message.decode()
        except (IndexError, ValueError) as error:
            raise LinkError(f"{self.place}: a spoilt message came ({kind:#x}: {error})") from error
        return message

"""A robot on a serial port as a python-can interface: ``can.Bus(interface="sceann_serial", channel="/dev/ttyACM0")``.

python-can's viewer, loggers and players work on it like on any CAN adapter. The channel is whatever
``serial.serial_for_url`` takes: a device, ``socket://host:port``, ``rfc2217://host:port``, ``loop://``.
"""

from __future__ import annotations

import contextlib
import io
import time
from collections import deque
from collections.abc import Sequence
from typing import Any

import can
import serial
from can.typechecking import AutoDetectedConfig
from serial.tools import list_ports

from sceann_hil.link.framing import DELIMITER, Deframer, encode_frame

LARGEST_IDENTIFIER = 0x7FF
WRITE_TIMEOUT_S = 0.2


class SceannSerialBus(can.BusABC):
    """Classic CAN frames with 11-bit identifiers, framed as ``docs/link.md`` says.

    Args:
        channel: serial device or pyserial URL.
        bitrate: baud.
        **kwargs: what every python-can bus takes, such as ``can_filters``.

    Raises:
        can.CanInitializationError: the port cannot be opened.
    """

    def __init__(self, channel: str, bitrate: int = 115_200, **kwargs: Any) -> None:
        try:
            self._port = serial.serial_for_url(
                channel, baudrate=bitrate, timeout=0.0, write_timeout=WRITE_TIMEOUT_S, do_not_open=True
            )
            if "://" not in channel:
                self._port.exclusive = True
            self._port.open()
        except (OSError, ValueError) as error:
            raise can.CanInitializationError(f"{channel}: cannot open this port ({error})") from error
        # adapters with an FTDI chip collect bytes for 16 ms unless they are told not to
        with contextlib.suppress(OSError, ValueError, AttributeError, NotImplementedError):
            self._port.set_low_latency_mode(True)
        self.channel_info = f"sceann serial {channel}"
        self._can_protocol = can.CanProtocol.CAN_20
        self._deframer = Deframer()
        self._received: deque[can.Message] = deque()
        super().__init__(channel, **kwargs)
        self._write(DELIMITER)

    @property
    def broken_frames(self) -> int:
        """Frames that were dropped because their check failed."""
        return self._deframer.broken

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a data frame; `timeout` is ignored, a port that takes nothing for 0.2 s is an error.

        Raises:
            ValueError: extended, remote, error or FD frames: the link has none.
            can.CanOperationError: the port is gone.
            can.CanTimeoutError: it takes no bytes.
        """
        if msg.is_extended_id or msg.is_remote_frame or msg.is_error_frame or msg.is_fd:
            raise ValueError(f"message: expected a classic data frame with an 11-bit identifier, got {msg}")
        self._write(encode_frame(msg.arbitration_id, bytes(msg.data)))

    def _write(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except serial.SerialTimeoutException as error:
            raise can.CanTimeoutError(f"{self.channel_info}: the port takes no bytes") from error
        except (serial.SerialException, OSError, TypeError) as error:
            raise can.CanOperationError(f"{self.channel_info}: cannot write ({error})") from error

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame, or None after `timeout` seconds.

        python-can's own `recv` reads the wall clock: set back by an hour it would wait for an hour.

        Raises:
            can.CanOperationError: the port is gone.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            message, _ = self._recv_internal(None if deadline is None else max(0.0, deadline - time.monotonic()))
            if message is None or self._matches_filters(message):
                return message

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self._received:
            return self._received.popleft(), False
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            left = None if deadline is None else max(0.0, deadline - time.monotonic())
            data = self._read(left)
            stamp = time.time()
            for identifier, payload in self._deframer.feed(data):
                if identifier <= LARGEST_IDENTIFIER:
                    self._received.append(
                        can.Message(timestamp=stamp, arbitration_id=identifier, is_extended_id=False, data=payload)
                    )
                else:
                    self._deframer.broken += 1
            if self._received:
                return self._received.popleft(), False
            if deadline is not None and time.monotonic() >= deadline:
                return None, False

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
        return [{"interface": "sceann_serial", "channel": port.device} for port in list_ports.comports()]

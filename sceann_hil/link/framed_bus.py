"""A stream of bytes as a python-can bus: what serial ports and emulated boards share."""

from __future__ import annotations

import time
from abc import abstractmethod
from collections import deque
from typing import Any, Protocol

import can

from sceann_hil.link.framing import Deframer, encode_frame

LARGEST_IDENTIFIER = 0x7FF


class FramedBus(can.BusABC):
    """Classic CAN frames with 11-bit identifiers, framed as ``docs/link.md`` says.

    Attributes:
        bytes_received: everything that came, valid or not.
        frames_received: how many valid frames were in it; 0 with many bytes is another firmware or another speed.

    Args:
        channel: what to call it.
        **kwargs: what every python-can bus takes, such as ``can_filters``.
    """

    def __init__(self, channel: str, **kwargs: Any) -> None:
        self.bytes_received = 0
        self.frames_received = 0
        self._can_protocol = can.CanProtocol.CAN_20
        self._deframer = Deframer()
        self._received: deque[can.Message] = deque()
        super().__init__(channel, **kwargs)

    @abstractmethod
    def _read(self, timeout_s: float | None) -> bytes:
        """What has come, waiting at most so long for the first byte."""

    @abstractmethod
    def _write(self, data: bytes) -> None:
        """Send all of it."""

    @property
    def broken_frames(self) -> int:
        """Frames that were dropped because their check failed."""
        return self._deframer.broken

    def now_s(self) -> float:
        """The clock by which this bus waits; monotonic."""
        return time.monotonic()

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a data frame; `timeout` is ignored.

        Raises:
            ValueError: extended, remote, error or FD frames: the link has none.
            can.CanOperationError: the line is gone.
            can.CanTimeoutError: it takes no bytes.
        """
        if msg.is_extended_id or msg.is_remote_frame or msg.is_error_frame or msg.is_fd:
            raise ValueError(f"message: expected a classic data frame with an 11-bit identifier, got {msg}")
        self._write(encode_frame(msg.arbitration_id, bytes(msg.data)))

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """The next frame, or None after `timeout` seconds.

        python-can's own `recv` reads the wall clock: set back by an hour it would wait for an hour.

        Raises:
            can.CanOperationError: the line is gone.
        """
        deadline = None if timeout is None else self.now_s() + timeout
        while True:
            message, _ = self._recv_internal(None if deadline is None else max(0.0, deadline - self.now_s()))
            if message is None or self._matches_filters(message):
                return message

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self._received:
            return self._received.popleft(), False
        deadline = None if timeout is None else self.now_s() + timeout
        while True:
            left = None if deadline is None else max(0.0, deadline - self.now_s())
            data = self._read(left)
            self.bytes_received += len(data)
            stamp = time.time()
            for identifier, payload in self._deframer.feed(data):
                if identifier <= LARGEST_IDENTIFIER:
                    self.frames_received += 1
                    self._received.append(
                        can.Message(timestamp=stamp, arbitration_id=identifier, is_extended_id=False, data=payload)
                    )
                else:
                    self._deframer.broken += 1
            if self._received:
                return self._received.popleft(), False
            if deadline is not None and self.now_s() >= deadline:
                return None, False


class Line(Protocol):
    """A serial line of an emulated board."""

    def write(self, data: bytes, /) -> None:
        """Sends all of it."""

    def read(self, timeout_s: float, /) -> bytes:
        """What has come, waiting at most so long for the first byte; empty after that time."""


class LineBus(FramedBus):
    """An emulated board's line as a bus.

    A line may have a clock of its own (`now_s`): that of a simulated chip, whose time passes only while somebody reads.
    Then every deadline counts in it, and nothing depends on how busy this computer is.

    Args:
        line: the host's end.
        name: what to call the board.
    """

    def __init__(self, line: Line, name: str = "emulated board") -> None:
        self._line = line
        self._clock = getattr(line, "now_s", time.monotonic)
        self.channel_info = name
        super().__init__(name)

    @property
    def own_clock(self) -> bool:
        """Time stands still between two calls."""
        return hasattr(self._line, "now_s")

    def now_s(self) -> float:
        return float(self._clock())

    def _read(self, timeout_s: float | None) -> bytes:
        return self._line.read(3600.0 if timeout_s is None else timeout_s)

    def _write(self, data: bytes) -> None:
        self._line.write(data)

"""The posix board: the firmware as a process, its line on a socket or a pseudo-terminal, its body on a socket.

The body's records are those of ``firmware/boards/posix/board.h``: what arrives there is what the motor driver's pins
would see, whatever the host believes.
"""

from __future__ import annotations

import os
import socket
import struct
import subprocess
from dataclasses import dataclass
from enum import IntFlag, StrEnum
from pathlib import Path
from types import TracebackType
from typing import Self

from sceann_hil.firmware.build import Board, build_board
from sceann_hil.firmware.emulated.pseudo_terminal import open_pseudo_terminal
from sceann_hil.firmware.emulated.sockets import SocketLine

BOARD_RECORD = struct.Struct("<cBI3H4x")
BODY_RECORD = struct.Struct("<cxHH12H2x")
MAX_SENSORS = 12


class Alarm(IntFlag):
    """What a body can raise: bits of the record that it sends."""

    NONE = 0
    ESTOP = 0x01
    BREAK = 0x02
    BUMPER = 0x04
    BATTERY = 0x08


class RecordKind(StrEnum):
    """What the board tells its body."""

    DRIVE = "D"
    SAFE = "S"
    QUERY = "Q"


@dataclass(frozen=True, slots=True)
class BoardRecord:
    """One thing that happened at the board's pins.

    Attributes:
        kind: motors driven, safe output, or sensors read.
        time_us: the board's clock, 32 bits.
        motors: Q10, only of a DRIVE record.
    """

    kind: RecordKind
    time_us: int
    motors: tuple[int, ...]


class PosixBody:
    """The far end of a posix board's pins. The robot's time stands still until a QUERY is answered."""

    def __init__(self, end: socket.socket) -> None:
        self.socket = end
        self._part = b""

    def records(self, timeout_s: float) -> list[BoardRecord]:
        """What happened since the last call, waiting at most `timeout_s` for the first record.

        Raises:
            EOFError: the board is gone.
        """
        self.socket.settimeout(timeout_s)
        try:
            data = self.socket.recv(65536)
        except (TimeoutError, BlockingIOError):
            return []
        if not data:
            raise EOFError("the board closed its end")
        data = self._part + data
        whole = len(data) - len(data) % BOARD_RECORD.size
        self._part = data[whole:]
        return [
            BoardRecord(RecordKind(kind.decode()), time_us, tuple(motors[:count]))
            for kind, count, time_us, *motors in BOARD_RECORD.iter_unpack(data[:whole])
        ]

    def answer(self, sensors: list[int], battery_mv: int = 0, alarms: Alarm = Alarm.NONE) -> None:
        """The sensors that a QUERY asked for."""
        self._send(b"A", sensors, battery_mv, alarms)

    def tell(self, sensors: list[int], battery_mv: int = 0, alarms: Alarm = Alarm.NONE) -> None:
        """Values unasked: an alarm between two ticks."""
        self._send(b"V", sensors, battery_mv, alarms)

    def _send(self, kind: bytes, sensors: list[int], battery_mv: int, alarms: Alarm) -> None:
        values = [*sensors, *[0] * (MAX_SENSORS - len(sensors))]
        self.socket.sendall(BODY_RECORD.pack(kind, int(alarms), battery_mv, *values))


class PosixBoard:
    """A running posix board.

    Attributes:
        line: the host's end of its serial line; None when it is on a pseudo-terminal.
        port: path of the pseudo-terminal, for pyserial and other programs; None when it is on a socket.
        body: its pins; None without a body.

    Args:
        n_sensors: of the body; 0 for a board without a body (HIL only).
        n_motors: of the body.
        store: file that keeps what an EEPROM keeps.
        baud: pace the line like a UART; None for as fast as it goes.
        terminal: put the line on a pseudo-terminal instead of a socket.
        node: the robot's number, 1..127.
        name: what the robot calls itself, at most 21 ASCII characters.
        unique_id: the number that tells it from others.
    """

    def __init__(
        self,
        *,
        n_sensors: int = 0,
        n_motors: int = 0,
        store: Path | None = None,
        baud: int | None = None,
        terminal: bool = False,
        node: int = 1,
        name: str = "posix",
        unique_id: int = 0,
    ) -> None:
        self._arguments = ["--node", str(node), "--name", name, "--id", str(unique_id)]
        if store is not None:
            self._arguments += ["--store", str(store)]
        if baud is not None:
            self._arguments += ["--baud", str(baud)]
        self._sizes = (n_sensors, n_motors)
        self.line: SocketLine | None = None
        self.port: Path | None = None
        self.body: PosixBody | None = None
        self._slave: int | None = None
        if terminal:
            self._link, self._slave, self.port = open_pseudo_terminal()
        else:
            host, board = socket.socketpair()
            self.line, self._link = SocketLine(host), board.detach()
        # the board ends when our end of this pipe is closed, however this process ends
        self._alive, self._our_life = os.pipe()
        self._body_fd: int | None = None
        if n_sensors:
            near, far = socket.socketpair()
            self.body, self._body_fd = PosixBody(near), far.detach()
        self.process = self._launch()

    def _launch(self) -> subprocess.Popen[bytes]:
        command = [str(build_board(Board.POSIX)), "--link", str(self._link), *self._arguments]
        command += ["--alive", str(self._alive)]
        descriptors = [self._link, self._alive]
        if self._body_fd is not None:
            n_sensors, n_motors = self._sizes
            command += ["--body", str(self._body_fd), "--sensors", str(n_sensors), "--motors", str(n_motors)]
            descriptors.append(self._body_fd)
        return subprocess.Popen(command, pass_fds=descriptors, stdin=subprocess.DEVNULL)

    def power_off(self) -> None:
        """The process is gone from one instruction to the next; line, body and store stay."""
        self.process.kill()
        self.process.wait()

    def power_on(self) -> None:
        """Starts it anew on the same line, body and store."""
        self.process = self._launch()

    def close(self) -> None:
        """Ends it and closes everything."""
        self.power_off()
        for descriptor in (self._link, self._alive, self._our_life, self._slave, self._body_fd):
            if descriptor is not None:
                os.close(descriptor)
        if self.line is not None:
            self.line.close()
        if self.body is not None:
            self.body.socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

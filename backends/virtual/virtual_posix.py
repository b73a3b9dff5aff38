"""The posix board as a virtual robot: the firmware as a process, a body behind its pins, a port like a real one."""

from __future__ import annotations

import hashlib
import secrets
import socket
import threading
from collections import deque
from pathlib import Path
from types import TracebackType
from typing import Self

from backends.virtual.body import VirtualBody
from backends.virtual.rig_server import RigServer
from sceann_hil.firmware.emulated.posix import Alarm, BoardRecord, PosixBoard, RecordKind

LOG_LENGTH = 100_000


def _unique_id(store: Path | None) -> int:
    """A number that tells this robot from others; the same as long as its store is kept."""
    if store is None:
        return secrets.randbits(48)
    return int.from_bytes(hashlib.sha256(str(store.resolve()).encode()).digest()[:6], "little")


class VirtualPosix:
    """A robot without hardware that the host cannot tell from one with.

    Attributes:
        board: the firmware's process, its line on a pseudo-terminal or a socket.
        body: what it drives; None for a board without a body (mode hil only).
        rig: puts the body back; None without a body.
        driver_log: what arrived at the motor driver (DRIVE and SAFE records), oldest first.

    Args:
        body: what hangs on its pins, if anything.
        baud: pace the line like a UART; None for as fast as it goes.
        store: file that keeps what an EEPROM keeps.
        terminal: the line is a pseudo-terminal; otherwise a socket.
        node: its number.
        rig_port: TCP port of the rig; 0 for any.
    """

    def __init__(
        self,
        body: VirtualBody | None,
        *,
        baud: int | None = None,
        store: Path | None = None,
        terminal: bool = True,
        node: int = 1,
        rig_port: int = 0,
    ) -> None:
        self.body = body
        self.driver_log: deque[BoardRecord] = deque(maxlen=LOG_LENGTH)
        spec = body.robot.spec if body is not None else None
        # before the board, which would be left running if there is no such port
        self.rig = RigServer(body, rig_port) if body is not None else None
        self.board = PosixBoard(
            n_sensors=spec.n_sensors if spec else 0,
            n_motors=spec.n_motors if spec else 0,
            store=store,
            baud=baud,
            terminal=terminal,
            node=node,
            unique_id=_unique_id(store),
            name=f"virtual {spec.name}" if spec else "virtual (hil only)",
        )
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="virtual body", daemon=True)
        if body is not None:
            self._thread.start()

    def _serve(self) -> None:
        pins, body = self.board.body, self.body
        if pins is None or body is None:
            return
        told: Alarm | None = None
        try:
            while not self._closing.is_set():
                for record in pins.records(0.02):
                    if record.kind is RecordKind.QUERY:
                        told = body.alarms
                        pins.answer(body.sense(), body.battery_mv, told)
                    elif record.kind is RecordKind.DRIVE:
                        self.driver_log.append(record)
                        body.drive(record.motors)
                    else:
                        self.driver_log.append(record)
                        body.safe()
                if body.alarms != told:
                    told = body.alarms
                    pins.tell([0] * body.robot.spec.n_sensors, body.battery_mv, told)
        except (EOFError, OSError):
            return

    @property
    def socket(self) -> socket.socket:
        """The host's end of a line that is no pseudo-terminal.

        Raises:
            ValueError: it is one.
        """
        if self.board.line is None:
            raise ValueError("line: expected a socket, got a pseudo-terminal")
        return self.board.line.socket

    @property
    def port(self) -> str:
        """Path of the pseudo-terminal."""
        return str(self.board.port)

    def power_cycle(self) -> None:
        """Off and on again; without power the motor driver's pull-downs hold the safe output."""
        self.board.power_off()
        if self.body is not None:
            self.body.safe()
        self.board.power_on()

    def close(self) -> None:
        """Switch it off."""
        self._closing.set()
        if self._thread.is_alive():
            self._thread.join()
        if self.rig is not None:
            self.rig.close()
        self.board.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

"""A serial board on a CAN channel: its frames on any python-can bus, and the bus's frames to it."""

from __future__ import annotations

import select
import socket
import threading

import can

from sceann_hil.link.framing import Deframer, encode_frame
from sceann_hil.link.line import is_ours


class CanBridge:
    """Carries frames between a board's socket and a bus, until it is closed.

    Args:
        board: the host's end of the board's line.
        bus: shut down when the bridge is closed.
    """

    def __init__(self, board: socket.socket, bus: can.BusABC) -> None:
        self._board, self._bus = board, bus
        self._closing = threading.Event()
        self._threads = [
            threading.Thread(target=work, name=name, daemon=True)
            for work, name in ((self._to_bus, "board to CAN"), (self._to_board, "CAN to board"))
        ]
        for thread in self._threads:
            thread.start()

    def _to_bus(self) -> None:
        deframer = Deframer()
        while not self._closing.is_set():
            if not select.select([self._board], [], [], 0.05)[0]:
                continue
            data = self._board.recv(65536)
            if not data:
                return
            for identifier, payload in deframer.feed(data):
                self._bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=payload))

    def _to_board(self) -> None:
        while not self._closing.is_set():
            message = self._bus.recv(0.05)
            if message is not None and is_ours(message):
                self._board.sendall(encode_frame(message.arbitration_id, bytes(message.data)))

    def close(self) -> None:
        """Take the board off the bus."""
        self._closing.set()
        for thread in self._threads:
            thread.join()
        self._bus.shutdown()

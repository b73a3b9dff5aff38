"""A connected socket as the host's end of an emulated serial line."""

from __future__ import annotations

import select
import socket


class SocketLine:
    """`read` and `write` of `sceann_hil.link.framed_bus.Line` on a socket."""

    def __init__(self, end: socket.socket) -> None:
        self.socket = end
        end.setblocking(True)

    def write(self, data: bytes) -> None:
        """Sends all of it."""
        self.socket.sendall(data)

    def read(self, timeout_s: float) -> bytes:
        """What has come, waiting at most `timeout_s` for the first byte; empty if nothing or the end is closed."""
        if not select.select([self.socket], [], [], timeout_s)[0]:
            return b""
        try:
            return self.socket.recv(65536)
        except ConnectionResetError:
            return b""

    def close(self) -> None:
        """Closes the host's end."""
        self.socket.close()

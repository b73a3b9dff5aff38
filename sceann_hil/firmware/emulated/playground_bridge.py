"""Runs inside a network namespace: Aseba Playground, and a way to it from one port outside.

    python playground_bridge.py LISTENING_DESCRIPTOR INNER_PORT PROGRAM ARGUMENT ...

The playground listens on every interface; in a namespace of its own there is none but the loopback. Every connection
that arrives at the descriptor, which was opened outside, is carried on to it.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import socket
import struct
import sys
import threading
import time
from contextlib import suppress

_SIOCSIFFLAGS, _IFF_UP, _PR_SET_PDEATHSIG, _SIGKILL = 0x8914, 1, 1, 9


def loopback_up() -> None:
    """A fresh namespace has its loopback switched off."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, _SIOCSIFFLAGS, struct.pack("16sh14s", b"lo", _IFF_UP, b""))


def carry(source: socket.socket, to: socket.socket) -> None:
    """Bytes from one socket to the other, until either is closed."""
    with suppress(OSError):
        while data := source.recv(4096):
            to.sendall(data)
    for each in (source, to):
        with suppress(OSError):
            each.shutdown(socket.SHUT_RDWR)


def connected(port: int) -> socket.socket:
    """A connection to the playground, as soon as it listens."""
    while True:
        try:
            inner = socket.create_connection(("127.0.0.1", port))
            inner.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return inner
        except ConnectionRefusedError:
            time.sleep(0.02)


def bridge(listener: socket.socket, port: int) -> None:
    """Carry every connection; never returns."""
    while True:
        outer, _ = listener.accept()
        outer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        inner = connected(port)
        for one, other in ((outer, inner), (inner, outer)):
            threading.Thread(target=carry, args=(one, other), daemon=True).start()


if __name__ == "__main__":
    descriptor, inner_port, *command = sys.argv[1:]
    loopback_up()
    if os.fork() == 0:
        # the bridge ends with the playground, which takes this process's place
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, _SIGKILL)
        bridge(socket.socket(fileno=int(descriptor)), int(inner_port))
    os.close(int(descriptor))
    os.execvp(command[0], command)

"""Runs inside a network namespace: Aseba Playground, and a way to it from one port outside.

    python playground_bridge.py LISTENING_DESCRIPTOR INNER_PORT PROGRAM ARGUMENT ...

The playground listens on every interface; in a namespace of its own there is none but the loopback. Every connection
that arrives at the descriptor, which was opened outside, is carried on to it.
"""

from __future__ import annotations

import ctypes
import os
import select
import socket
import struct
import sys
import time
from contextlib import suppress

_HEADER = 6
_SIOCSIFFLAGS, _IFF_UP, _PR_SET_PDEATHSIG, _SIGKILL = 0x8914, 1, 1, 9


def loopback_up() -> None:
    """A fresh namespace has its loopback switched off."""
    if sys.platform == "win32":
        return
    # POSIX only, as this program is
    import fcntl

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, _SIOCSIFFLAGS, struct.pack("16sh14s", b"lo", _IFF_UP, b""))


def connected(port: int) -> socket.socket:
    """A connection to the playground, as soon as it listens."""
    while True:
        try:
            inner = socket.create_connection(("127.0.0.1", port))
            inner.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return inner
        except ConnectionRefusedError:
            time.sleep(0.02)


def whole_messages(heard: bytearray) -> bytes:
    """What has come of whole messages; the beginning of another one stays."""
    end = 0
    while len(heard) >= end + _HEADER and len(heard) >= end + _HEADER + int.from_bytes(heard[end : end + 2], "little"):
        end += _HEADER + int.from_bytes(heard[end : end + 2], "little")
    whole = bytes(heard[:end])
    del heard[:end]
    return whole


def bridge(listener: socket.socket, port: int) -> None:
    """Carry messages between the playground and whoever connected last; returns when the playground is gone.

    The playground keeps one connection for all its life: it does not always survive that one goes and the next comes in
    the same of its steps.
    """
    inner, outer = connected(port), None
    to_inner, to_outer = bytearray(), bytearray()
    while True:
        ready, _, _ = select.select([listener, inner, *([outer] if outer else [])], [], [])
        if inner in ready:
            if not (data := inner.recv(4096)):
                return
            to_outer += data
            message = whole_messages(to_outer)
            if outer is not None:
                with suppress(OSError):
                    outer.sendall(message)
        if outer is not None and outer in ready:
            data = b""
            with suppress(OSError):
                data = outer.recv(4096)
            to_inner += data
            if data:
                inner.sendall(whole_messages(to_inner))
            else:
                outer.close()
                outer = None
        if listener in ready:
            if outer is not None:
                outer.close()
            outer, _ = listener.accept()
            outer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            to_inner.clear()


if sys.platform != "win32" and __name__ == "__main__":
    descriptor, inner_port, *command = sys.argv[1:]
    loopback_up()
    if os.fork() == 0:
        # the bridge ends with the playground, which takes this process's place
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, _SIGKILL)
        bridge(socket.socket(fileno=int(descriptor)), int(inner_port))
    os.close(int(descriptor))
    os.execvp(command[0], command)

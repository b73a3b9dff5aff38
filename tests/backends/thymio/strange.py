"""Nodes that speak Aseba over TCP and are no good Thymio."""

from __future__ import annotations

import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from sceann_hil.firmware.aesl.target import NATIVES, THYMIO, Target

Message = tuple[int, bytes]


def _string(text: str) -> bytes:
    return bytes([len(text)]) + text.encode()


def words(*values: int) -> bytes:
    """Words as they are on the line."""
    return struct.pack(f"<{len(values)}H", *(value & 0xFFFF for value in values))


def description(target: Target = THYMIO) -> Iterator[Message]:
    """Kinds and contents of the messages by which a node describes itself."""
    counts = len(target.variables), len(target.local_events), len(target.functions)
    yield 0x9000, _string(target.name) + words(5, target.bytecode_words, 32, target.variable_words, *counts)
    for name, length in target.variables.items():
        yield 0x9001, words(length) + _string(name)
    for name in target.local_events:
        yield 0x9002, _string(name) + _string("")
    for name in target.functions:
        lengths = NATIVES.get(name, ())
        arguments = b"".join(words(length) + _string(f"a{k}") for k, length in enumerate(lengths))
        yield 0x9003, _string(name) + _string("") + words(len(lengths)) + arguments


@dataclass
class Node:
    """What answers.

    Attributes:
        target: as which it describes itself; None: not at all.
        version: of the protocol.
        numbers: of the nodes that are there.
        host: where.
    """

    target: Target | None = THYMIO
    version: int = 5
    numbers: tuple[int, ...] = (1,)
    host: str = ""

    def answer(self, line: socket.socket) -> None:
        """Until the other end hangs up."""
        with line, line.makefile("rb") as heard:
            while len(header := heard.read(6)) == 6:
                length, _, kind = struct.unpack("<3H", header)
                heard.read(length)
                if kind == 0xA011:
                    for number in self.numbers:
                        line.sendall(struct.pack("<3H", 2, number, 0x900C) + words(self.version))
                elif kind == 0xA010 and self.target is not None:
                    for told, payload in description(self.target):
                        line.sendall(struct.pack("<3H", len(payload), self.numbers[0], told) + payload)


@contextmanager
def there(node: Node) -> Iterator[Node]:
    """The node at a port of this computer."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        node.host = f"127.0.0.1:{server.getsockname()[1]}"

        def accept() -> None:
            node.answer(server.accept()[0])

        thread = threading.Thread(target=accept, daemon=True)
        thread.start()
        yield node

"""Which connections may stay: those that show the token, and a few of all others for a while.

Whoever has no token can open connections as fast as the network allows. None of them may cost the run a file that it
needs, or the person with the phone their STOP. So nothing is read from a connection before it is known what it is:

* It waits in the *lobby*, a bare socket, until something has come. The lobby holds `MOST_WAITING`, each for at most
  `PATIENCE_S`; one more and the oldest of the address that has most of them goes. Who floods, displaces himself.
* What has come is looked at without taking it. If the token is in it, the connection goes to the HTTP server at once.
  If not, it is a *stranger's*: `POLITE_PER_S` of them go there too, to be told what they lack; most others are told
  that they are too many, and under a flood they are just closed.
* A connection whose request had the right token is a *friend's*. No stranger displaces it, and it stays open between
  requests: the page's next press goes over a connection that is there already.
"""

from __future__ import annotations

import asyncio
import selectors
import socket
import sys
import time
from collections import OrderedDict
from collections.abc import Callable, Coroutine, Sequence
from contextlib import suppress
from functools import lru_cache
from ipaddress import ip_address
from typing import Any, Generic, TypeVar

PATIENCE_S = 5.0
"""How long somebody has who has not shown the token."""
MOST_WAITING = 384
MOST_STRANGERS = 32
MOST_FRIENDS = 64
POLITE_PER_S = 100.0
POLITE_AT_ONCE = 300.0
ANSWERED_PER_S = 300.0
SLICE_S = 0.003
"""So long connections are accepted, or looked at, before friends have their turn again."""
BETWEEN_LOOKS_S = 0.01
_PEEK = 8192
_TOO_MANY = b"HTTP/1.1 429 Too Many Requests\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"

Guest = TypeVar("Guest")


def share_of_files(most: int) -> int:
    """So many, but never so many that the run lacks files where a process may open few."""
    if sys.platform == "win32":
        return most
    import resource

    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return most if files == resource.RLIM_INFINITY else max(8, min(most, files * 3 // 8))


def serve_until_done(work: Coroutine[Any, Any, None]) -> None:
    """Run an event loop that can watch sockets: on Windows the usual one cannot."""
    with asyncio.Runner(loop_factory=asyncio.SelectorEventLoop) as runner:
        runner.run(work)


class Crowd(Generic[Guest]):
    """At most `most` connections; one more and the oldest of the address that has most of them is closed.

    Args:
        most: how many.
        close: closes one.
    """

    def __init__(self, most: int, close: Callable[[Guest], object]) -> None:
        self._most = most
        self._close = close
        self._by_neighbour: dict[str, OrderedDict[Guest, float]] = {}
        self._neighbours: dict[Guest, str] = {}

    def __len__(self) -> int:
        return len(self._neighbours)

    def __contains__(self, guest: Guest) -> bool:
        return guest in self._neighbours

    def add(self, guest: Guest, address: str = "") -> None:
        """One more, the youngest."""
        neighbour = self._neighbours.setdefault(guest, _neighbourhood(address))
        self._by_neighbour.setdefault(neighbour, OrderedDict())[guest] = time.monotonic()
        if len(self) > self._most:
            fullest = max(self._by_neighbour, key=lambda neighbour: len(self._by_neighbour[neighbour]))
            self._drop(next(iter(self._by_neighbour[fullest])))

    def discard(self, guest: Guest) -> bool:
        """Forget one, without closing it; whether it was there."""
        neighbour = self._neighbours.pop(guest, None)
        if neighbour is None:
            return False
        crowd = self._by_neighbour[neighbour]
        del crowd[guest]
        if not crowd:
            del self._by_neighbour[neighbour]
        return True

    def sweep(self, patience_s: float = 0.0) -> None:
        """Close all that are there for at least so long."""
        until = time.monotonic() - patience_s
        for crowd in list(self._by_neighbour.values()):
            for guest in [guest for guest, since in crowd.items() if since <= until]:
                self._drop(guest)

    def _drop(self, guest: Guest) -> None:
        if self.discard(guest):
            self._close(guest)


class Pace:
    """Lets `per_s` through per second, and `at_once` at once after a quiet time."""

    def __init__(self, per_s: float, at_once: float) -> None:
        self._per_s = per_s
        self._most = self._left = at_once
        self._looked_s = time.monotonic()

    def allows(self) -> bool:
        """Whether one more may pass now."""
        now_s = time.monotonic()
        self._left = min(self._most, self._left + (now_s - self._looked_s) * self._per_s)
        self._looked_s = now_s
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True


class Lobby:
    """Where connections wait until it is known what they are. Used in the thread of its event loop.

    Args:
        listening: sockets that listen.
        token: what opens the door.
        admit: gets a connection, its address and whether the token is in what has come.
    """

    def __init__(
        self, listening: Sequence[socket.socket], token: bytes, admit: Callable[[socket.socket, Any, bool], object]
    ) -> None:
        self._listening = listening
        self._token = token
        self._admit = admit
        self._loop = asyncio.get_running_loop()
        self._waiting: Crowd[socket.socket] = Crowd(share_of_files(MOST_WAITING), self._turn_out)
        self._polite = Pace(POLITE_PER_S, POLITE_AT_ONCE)
        self._answered = Pace(ANSWERED_PER_S, 10 * ANSWERED_PER_S)
        # all that wait are one thing to look at for the event loop: it does not serve hundreds before a friend
        self._speaking = selectors.DefaultSelector()
        if sys.platform == "win32":
            self._looking = asyncio.create_task(self._look_round_and_round())
        else:
            self._loop.add_reader(self._speaking, self._look_round)
        for one in listening:
            self._loop.add_reader(one, self._accept, one)

    def __len__(self) -> int:
        return len(self._waiting)

    def sweep(self) -> None:
        """Close what has waited for too long."""
        self._waiting.sweep(PATIENCE_S)

    def stop(self) -> None:
        """Close everything."""
        for one in self._listening:
            self._loop.remove_reader(one)
            one.close()
        self._waiting.sweep()
        if sys.platform == "win32":
            self._looking.cancel()
        else:
            self._loop.remove_reader(self._speaking)
        self._speaking.close()

    def _accept(self, listening: socket.socket) -> None:
        until = time.monotonic() + SLICE_S
        while time.monotonic() < until:
            try:
                connection, address = listening.accept()
            except OSError:
                # none is left, it has gone again, or this process may open no more files
                return
            connection.setblocking(False)
            if not self._look(connection, address):
                self._waiting.add(connection, str(address[0]))
                self._speaking.register(connection, selectors.EVENT_READ, address)

    async def _look_round_and_round(self) -> None:
        """Where a selector is nothing that an event loop can watch."""
        while True:
            if len(self._waiting):
                self._look_round()
            await asyncio.sleep(BETWEEN_LOOKS_S)

    def _look_round(self) -> None:
        until = time.monotonic() + SLICE_S
        for key, _ in self._speaking.select(0):
            connection = key.fileobj
            if isinstance(connection, socket.socket) and self._waiting.discard(connection):
                self._speaking.unregister(connection)
                if not self._look(connection, key.data):
                    connection.close()
            if time.monotonic() > until:
                return

    def _look(self, connection: socket.socket, address: Any) -> bool:
        """Whether something has come, and the connection has gone where it belongs."""
        try:
            begun = connection.recv(_PEEK, socket.MSG_PEEK)
        except BlockingIOError:
            return False
        except OSError:
            begun = b""
        has_token = self._token in begun
        if begun and (has_token or self._polite.allows()):
            self._admit(connection, address, has_token)
            return True
        if begun and self._answered.allows():
            with suppress(OSError):
                # what is not read would reset the connection before the answer arrives
                connection.recv(_PEEK)
                connection.send(_TOO_MANY)
        connection.close()
        return True

    def _turn_out(self, connection: socket.socket) -> None:
        self._speaking.unregister(connection)
        connection.close()


@lru_cache(maxsize=1024)
def _neighbourhood(address: str) -> str:
    """An IPv4 address, or the network of an IPv6 one: there each of them has 2**64 addresses of their own."""
    try:
        ip = ip_address(address.partition("%")[0])
    except ValueError:
        return address
    return str(ip) if ip.version == 4 else f"{int(ip) >> 64:x}"

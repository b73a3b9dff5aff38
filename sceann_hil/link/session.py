"""A host in charge of one robot: requests that are repeated until they are answered."""

from __future__ import annotations

import secrets

import can

from sceann_hil.link.descriptor import PAGES, UNIQUE_ID_PAGE, Descriptor
from sceann_hil.link.line import RobotLine
from sceann_hil.link.messages import End, Reply, hello_arguments, pack_command
from sceann_hil.link.numbers import LINK_VERSION
from sceann_hil.link.vocabulary import Function, Op, Status
from sceann_hil.network.controller import ARITHMETIC_ID
from sceann_hil.robot import LinkError

REPLY_S = 0.25
"""How long to wait for a reply before a request is repeated."""
STORE_REPLY_S = 1.5
"""The same for STORE: an AVR writes its EEPROM at 3.4 ms per byte."""
TRIES = 6
_KNOWN_STATUS = frozenset(map(int, Status))
SECOND_ROBOT_S = 0.05
"""How long to wait for another robot's descriptor behind the first."""


class NoAnswer(LinkError):
    """The robot is silent."""


class TwoRobots(LinkError):
    """Two robots or more share one node number."""


class Refused(LinkError):
    """The robot answered a request with another status than OK.

    Attributes:
        op: the request.
        status: what the robot said.
        reply: the whole reply.
        repeated: the request had been sent more than once.
    """

    def __init__(self, op: Op, reply: Reply, *, repeated: bool = False) -> None:
        super().__init__(f"{op.name}: the robot refuses: {Status(reply.status).name}")
        self.op = op
        self.status = Status(reply.status)
        self.reply = reply
        self.repeated = repeated


class RobotLink(RobotLine):
    """The host's side of the link: a line, and requests on it."""

    def __init__(self, bus: can.BusABC, node: int = 1, session: int | None = None) -> None:
        super().__init__(bus, node, session)
        self._sequence = secrets.randbelow(16)

    def request(self, op: Op, arguments: bytes = b"", *, tries: int = TRIES) -> Reply:
        """One command and its reply. A command may be repeated: the robot does nothing twice.

        Raises:
            NoAnswer: silence, after all tries.
            Refused: the robot says no.
            LinkDown: the port or adapter is gone.
        """
        with self.exclusive():
            self._sequence = (self._sequence + 1) % 16
            command = pack_command(op, self._sequence, self.session, arguments)
            patience_s = STORE_REPLY_S if op is Op.STORE else REPLY_S
            # what another host on this bus was told before is no answer to us, though its number may be the same
            heard_until_s = self.now_s() + REPLY_S
            while self.now_s() < heard_until_s and self.receive(0.0) is not None:
                pass
            for attempt in range(tries):
                self.statistics.retries += attempt > 0
                sent_s = self.now_s()
                self.send(Function.COMMAND, command)
                while (left_s := sent_s + patience_s - self.now_s()) > 0:
                    incoming = self.receive(left_s)
                    if incoming is None or incoming.function != Function.REPLY or len(incoming.data) != 8:
                        continue
                    reply = Reply.unpack(incoming.data)
                    if (reply.op, reply.sequence) != (op, self._sequence):
                        continue
                    if reply.status not in _KNOWN_STATUS:
                        # newer firmware, another device, a chance check sum: no answer that this host understands
                        self.statistics.foreign += 1
                        continue
                    self.statistics.round_trips.add(self.now_s() - sent_s)
                    if reply.status != Status.OK:
                        raise Refused(op, reply, repeated=attempt > 0)
                    return reply
        raise NoAnswer(f"{op.name}: no reply from node {self.node} after {tries} tries")

    def hello(self, patience_s: float = 5.0) -> Descriptor:
        """Take the robot and read what it is.

        A robot that another host had keeps refusing for a second after that host fell silent, and a board that resets
        when its port is opened needs a moment: both are waited for.

        Raises:
            NoAnswer: silence for `patience_s`.
            LinkError: it speaks another link version or computes with another arithmetic; another host is in charge.
        """
        deadline = self.now_s() + patience_s
        while True:
            try:
                return self._hello()
            except (NoAnswer, Refused) as error:
                waiting = not isinstance(error, Refused) or error.status is Status.OTHER_HOST
                if not waiting or self.now_s() >= deadline:
                    raise self._explained(error, patience_s) from None

    def _hello(self) -> Descriptor:
        with self._lock:
            self.let_go()
            self.request(Op.HELLO, hello_arguments(ARITHMETIC_ID), tries=1)
            pages, ids = self._descriptor_pages()
            if len(ids) > 1:
                told = ", ".join(f"{number:014x}" for number in sorted(ids))
                raise TwoRobots(
                    f"{len(ids)} robots have node {self.node} (ids {told}) "
                    "and obey every command together; give each a node of its own: `sceann set-node` with only one of "
                    "them switched on"
                )
            if not all(page in pages for page in range(PAGES)):
                raise NoAnswer("HELLO: the robot's descriptor came only in parts")
            descriptor = Descriptor.from_pages(pages)
            descriptor.check_versions()
            self.take_charge()
        return descriptor

    def _descriptor_pages(self) -> tuple[dict[int, bytes], set[int]]:
        """The descriptor, and the unique ids of all who sent one: more than one robot may have this node."""
        pages: dict[int, bytes] = {}
        ids: set[int] = set()
        deadline = self.now_s() + REPLY_S
        while (left_s := deadline - self.now_s()) > 0:
            incoming = self.receive(left_s)
            if incoming is not None and incoming.function == Function.DESCRIPTOR and len(incoming.data) == 8:
                pages[incoming.data[0]] = incoming.data[1:]
                if incoming.data[0] == UNIQUE_ID_PAGE:
                    ids.add(int.from_bytes(incoming.data[1:], "little"))
                if len(pages) == PAGES:
                    deadline = min(deadline, self.now_s() + SECOND_ROBOT_S)
        return pages, ids

    def _explained(self, error: NoAnswer | Refused, patience_s: float) -> LinkError:
        if isinstance(error, NoAnswer):
            return NoAnswer(self._why_silent(patience_s))
        if error.status is Status.OTHER_HOST:
            return LinkError("another host is in charge of this robot; stop it first")
        if error.status is Status.LINK_VERSION:
            theirs = error.reply.data[0]
            return LinkError(f"link version: this host has {LINK_VERSION}, the robot {theirs}; flash current firmware")
        if error.status is Status.ARITHMETIC:
            theirs = int.from_bytes(error.reply.data[2:6], "little")
            return LinkError(
                f"arithmetic: this host has {ARITHMETIC_ID:08x}, the robot {theirs:08x}; flash current firmware"
            )
        return error

    def _why_silent(self, patience_s: float) -> str:
        came = getattr(self._bus, "bytes_received", 0)
        if self.statistics.received:
            return f"node {self.node} sends, but does not answer: check the line towards the robot"
        if came and not getattr(self._bus, "frames_received", 1):
            return (
                f"something else than sceann's firmware sends here ({came} bytes, no frame of ours): "
                "flash the board (`sceann flash`), or give the right baud rate"
            )
        return (
            f"silence: no robot answers as node {self.node} within {patience_s:g} s; is it switched on, "
            "is this its port, does it carry our firmware at this baud rate? A new board has to be flashed first"
        )

    def last(self) -> End:
        """The last trial that the robot remembers, also from before its power was off.

        Raises:
            NoAnswer, Refused, LinkDown: see `request`.
        """
        with self._lock:
            for _ in range(TRIES):
                self.last_end = None
                reply = self.request(Op.LAST)
                end = self.last_end
                if end is not None and end.trial_id == int.from_bytes(reply.data[:2], "little"):
                    return end
        raise NoAnswer("LAST: the reply comes, but never the END before it")

    def make_safe(self) -> bool:
        """Stop whatever runs; never raises. True if the robot acknowledged."""
        try:
            self.request(Op.STOP, tries=2)
        except Exception:
            # whatever a bus raises, the answer to "is it safe?" is no
            return False
        return True

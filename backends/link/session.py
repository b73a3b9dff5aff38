"""A host in charge of one robot: messages, heartbeats, and requests that are repeated until they are answered.

Whoever holds the link sends the heartbeats. Between trials that is a thread; during a trial and a request it is
`RobotLink.receive`, so that a host whose loop is stuck falls silent and the robot stops by itself within its 300 ms
deadline. All times are monotonic.
"""

from __future__ import annotations

import contextlib
import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import can

from backends.link.messages import (
    End,
    Event,
    Heartbeat,
    Reply,
    hello_arguments,
    host_heartbeat,
    identifier,
    pack_command,
)
from backends.link.statistics import LinkStatistics
from sceann_hil.controller import ARITHMETIC_ID
from sceann_hil.firmware.descriptor import PAGES, Descriptor
from sceann_hil.firmware.vocabulary import LINK_VERSION, EventCode, Function, Op, State, Status
from sceann_hil.robot import LinkError

HEARTBEAT_S = 0.1
REPLY_S = 0.25
"""How long to wait for a reply before a request is repeated."""
STORE_REPLY_S = 1.5
"""The same for STORE: an AVR writes its EEPROM at 3.4 ms per byte."""
TRIES = 6
STOP_SEQUENCE = 0
ESTOP_FRAMES = 3
"""Nothing acknowledges an emergency stop, so it is sent this often."""
HEARD_S = 0.25
"""A host that has not heard its robot for so long in a trial is silent too: the line may be broken one way only."""


class NoAnswer(LinkError):
    """The robot is silent."""


class LinkDown(LinkError):
    """The port or the CAN adapter is gone."""


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


class Incoming(NamedTuple):
    """A message from the robot."""

    function: int
    data: bytes


class RobotLink:
    """The host's side of the link on any python-can bus.

    Attributes:
        node: the robot's number, 1..127.
        session: by which the robot knows this host.
        statistics: frames, losses, latency.
        state: the robot's state as last heard; None before.
        battery_mv: as last heard; 0 = not measured.
        uptime_ms: as last heard.
        boots: EVENT BOOT messages heard since the link was opened.
        events: the last 256 events.
        last_end: the newest END heard.
        stop_wanted: somebody wants the trial that runs to end.

    Args:
        bus: open; the link shuts it down at `close`.
        node: which robot.
        session: 1..65535; drawn at random if None.
    """

    def __init__(self, bus: can.BusABC, node: int = 1, session: int | None = None) -> None:
        if not 1 <= node <= 127:
            raise ValueError(f"node: expected 1..127, got {node}")
        self.node = node
        self.session = session if session is not None else secrets.randbelow(0xFFFF) + 1
        self.statistics = LinkStatistics()
        self.state: State | None = None
        self.battery_mv = 0
        self.uptime_ms = 0
        self.boots = 0
        self.events: deque[Event] = deque(maxlen=256)
        self.last_end: End | None = None
        self._bus = bus
        self._lock = threading.RLock()
        self._sequence = secrets.randbelow(16)
        self._trial_id = 0
        self._listener: Callable[[Incoming], None] | None = None
        self._heard_s = time.monotonic()
        self._in_charge = False
        self._beat_due_s = 0.0
        self._closing = threading.Event()
        self.stop_wanted = False
        self._keeper: threading.Thread | None = None

    # -- messages ---------------------------------------------------------------------------------------------------

    def send(self, function: Function, data: bytes = b"") -> None:
        """Send one message.

        Raises:
            LinkDown: the port or adapter is gone.
        """
        message = can.Message(
            arbitration_id=identifier(function, self.node), is_extended_id=False, data=data, check=False
        )
        try:
            self._bus.send(message)
        except (can.CanError, OSError) as error:
            raise LinkDown(f"the link is gone: {error}") from error
        self.statistics.sent += 1

    def stop_now(self) -> None:
        """Send STOP at once, without waiting for a reply or for whoever holds the link; never raises.

        Whoever holds the link sees the robot end what it does; until then `stop_wanted` has it send STOP again. Safe
        from any thread: it is one frame.
        """
        self.stop_wanted = True
        with contextlib.suppress(LinkDown):
            self.send(Function.COMMAND, pack_command(Op.STOP, STOP_SEQUENCE))

    def emergency_stop(self) -> None:
        """Send the latched stop of all robots, several times, because nothing acknowledges it; never raises."""
        stop = can.Message(arbitration_id=0, is_extended_id=False, data=b"", check=False)
        for _ in range(ESTOP_FRAMES):
            with contextlib.suppress(can.CanError, OSError):
                self._bus.send(stop)

    def receive(self, timeout_s: float) -> Incoming | None:
        """The next message of this robot, or None after `timeout_s`; heartbeats go out meanwhile.

        Raises:
            LinkDown: the port or adapter is gone.
        """
        with self._lock:  # two readers of one port take each other's bytes
            return self._receive(timeout_s)

    def _receive(self, timeout_s: float) -> Incoming | None:
        deadline = time.monotonic() + timeout_s
        while True:
            now = time.monotonic()
            if self._in_charge and now >= self._beat_due_s:
                self._beat(now)
            wait_s = max(0.0, min(deadline - now, self._beat_due_s - now if self._in_charge else HEARTBEAT_S))
            try:
                message = self._bus.recv(wait_s)
            except (can.CanError, OSError, ValueError) as error:
                raise LinkDown(f"the link is gone: {error}") from error
            if message is not None and not message.is_error_frame and not message.is_extended_id:
                if message.arbitration_id & 0x7F == self.node:
                    self.statistics.received += 1
                    incoming = Incoming(message.arbitration_id & 0x780, bytes(message.data))
                    try:
                        self._note(incoming)
                    except ValueError:
                        # a number that this link version does not have: somebody else's device on the same bus
                        self.statistics.foreign += 1
                        continue
                    return incoming
            elif message is None and time.monotonic() >= deadline:
                return None

    def _note(self, incoming: Incoming) -> None:
        """Keep what is of interest whoever asked."""
        self._heard_s = time.monotonic()
        if self._listener is not None:
            self._listener(incoming)
        function, data = incoming
        if function == Function.HEARTBEAT and len(data) == 8:
            heartbeat = Heartbeat.unpack(data)
            self.state = State(heartbeat.state)
            self.battery_mv, self.uptime_ms = heartbeat.battery_mv, heartbeat.uptime_ms
            self.statistics.robot_receive_errors = heartbeat.receive_errors
        elif function == Function.EVENT and len(data) == 8:
            event = Event.unpack(data)
            self.state = State(event.state)
            self.events.append(event)
            self.boots += event.code == EventCode.BOOT
        elif function == Function.END and len(data) == 7:
            self.last_end = End.unpack(data)

    @property
    def silence_s(self) -> float:
        """Time since the robot was last heard."""
        return time.monotonic() - self._heard_s

    def _beat(self, now_s: float) -> None:
        if self._trial_id and now_s - self._heard_s > HEARD_S:
            return
        self.send(Function.HOST_HEARTBEAT, host_heartbeat(self._trial_id, self.session))
        self._beat_due_s = now_s + HEARTBEAT_S

    # -- who holds the link -----------------------------------------------------------------------------------------

    @contextmanager
    def exclusive(self, trial_id: int = 0) -> Iterator[None]:
        """Hold the link; its holder must call `receive` at least every 100 ms, or the robot stops.

        Args:
            trial_id: what heartbeats say that this host is doing.
        """
        with self._lock:
            before, self._trial_id = self._trial_id, trial_id or self._trial_id
            try:
                yield
            finally:
                self._trial_id = before

    @contextmanager
    def silent(self) -> Iterator[None]:
        """Send no heartbeats, to see what the robot makes of it."""
        with self._lock:
            self._in_charge = False
            try:
                yield
            finally:
                self._in_charge, self._beat_due_s = True, 0.0

    @contextmanager
    def listening(self, listener: Callable[[Incoming], None]) -> Iterator[None]:
        """Have `listener` told of every message first, whoever receives it."""
        self._listener = listener
        try:
            yield
        finally:
            self._listener = None

    def _keep(self) -> None:
        while not self._closing.wait(HEARTBEAT_S):
            if self._lock.acquire(blocking=False):
                try:
                    while self.receive(0.0) is not None:
                        pass
                except LinkError:
                    # whoever uses the link next finds out and tells
                    return
                finally:
                    self._lock.release()

    # -- requests ---------------------------------------------------------------------------------------------------

    def request(self, op: Op, arguments: bytes = b"", *, tries: int = TRIES) -> Reply:
        """One command and its reply. A command may be repeated: the robot does nothing twice.

        Raises:
            NoAnswer: silence, after all tries.
            Refused: the robot says no.
            LinkDown: the port or adapter is gone.
        """
        with self.exclusive():
            self._sequence = (self._sequence + 1) % 16
            command = pack_command(op, self._sequence, arguments)
            patience_s = STORE_REPLY_S if op is Op.STORE else REPLY_S
            for attempt in range(tries):
                self.statistics.retries += attempt > 0
                sent_s = time.monotonic()
                self.send(Function.COMMAND, command)
                while (left_s := sent_s + patience_s - time.monotonic()) > 0:
                    incoming = self.receive(left_s)
                    if incoming is None or incoming.function != Function.REPLY or len(incoming.data) != 8:
                        continue
                    reply = Reply.unpack(incoming.data)
                    if (reply.op, reply.sequence) != (op, self._sequence):
                        continue
                    self.statistics.round_trips.add(time.monotonic() - sent_s)
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
        deadline = time.monotonic() + patience_s
        while True:
            try:
                return self._hello()
            except (NoAnswer, Refused) as error:
                waiting = not isinstance(error, Refused) or error.status is Status.OTHER_HOST
                if not waiting or time.monotonic() >= deadline:
                    raise self._explained(error, patience_s) from None

    def _hello(self) -> Descriptor:
        with self._lock:
            pages: dict[int, bytes] = {}
            self._in_charge = False
            self.request(Op.HELLO, hello_arguments(self.session, ARITHMETIC_ID), tries=1)
            deadline = time.monotonic() + REPLY_S
            while len(pages) < PAGES and (left_s := deadline - time.monotonic()) > 0:
                incoming = self.receive(left_s)
                if incoming is not None and incoming.function == Function.DESCRIPTOR and len(incoming.data) == 8:
                    pages[incoming.data[0]] = incoming.data[1:]
            if not all(page in pages for page in range(PAGES)):
                raise NoAnswer("HELLO: the robot's descriptor came only in parts")
            descriptor = Descriptor.from_pages(pages)
            descriptor.check_versions()
            self._in_charge = True
            self._beat_due_s = 0.0
        if self._keeper is None or not self._keeper.is_alive():
            self._keeper = threading.Thread(target=self._keep, name="heartbeat", daemon=True)
            self._keeper.start()
        return descriptor

    def _explained(self, error: NoAnswer | Refused, patience_s: float) -> LinkError:
        if isinstance(error, NoAnswer):
            return NoAnswer(
                f"no robot answers as node {self.node} within {patience_s:g} s: is it switched on, is this its port, "
                "does it carry our firmware at this baud rate?"
            )
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
        except LinkError:
            return False
        return True

    def close(self) -> None:
        """End the heartbeats and shut the bus down. May be called twice."""
        self._closing.set()
        if self._keeper is not None:
            self._keeper.join()
        self._bus.shutdown()

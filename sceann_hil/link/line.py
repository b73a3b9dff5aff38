"""Messages to and from one robot, and the heartbeats that let it move.

Whoever holds the line sends the heartbeats. Between trials that is a thread; during a trial and a request it is
`RobotLine.receive`, so that a host whose loop is stuck falls silent and the robot stops by itself within its 300 ms
deadline. All times are those of the bus: monotonic, and of an emulated chip its own.
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

from sceann_hil.link.messages import End, Event, Heartbeat, host_heartbeat, identifier, pack_command
from sceann_hil.link.numbers import HEARTBEAT_S
from sceann_hil.link.statistics import LinkStatistics
from sceann_hil.link.vocabulary import EventCode, Function, Op, State
from sceann_hil.robot import LinkError

STOP_SEQUENCE = 0
ESTOP_FRAMES = 3
"""Nothing acknowledges an emergency stop, so it is sent this often."""
HEARD_S = 0.25
"""A host that has not heard its robot for so long in a trial is silent too: the line may be broken one way only."""


def is_ours(message: can.Message) -> bool:
    """A classic data frame with an 11-bit identifier: the link has no others, whatever else is on the bus."""
    return not (message.is_extended_id or message.is_remote_frame or message.is_error_frame or message.is_fd)


class LinkDown(LinkError):
    """The port or the CAN adapter is gone."""


class Incoming(NamedTuple):
    """A message from the robot."""

    function: int
    data: bytes


class RobotLine:
    """Messages and heartbeats on any python-can bus.

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
        self.stop_wanted = False
        self._bus = bus
        self._clock: Callable[[], float] = getattr(bus, "now_s", time.monotonic)
        self._lock = threading.RLock()
        self._trial_id = 0
        self._listener: Callable[[Incoming], None] | None = None
        self._heard_s = self._clock()
        self._in_charge = False
        self._beat_due_s = 0.0
        self._closing = threading.Event()
        self._keeper: threading.Thread | None = None

    def now_s(self) -> float:
        """The clock by which this line waits: monotonic, or a simulated chip's own."""
        return self._clock()

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
        except Exception as error:  # each CAN driver has exceptions of its own
            raise LinkDown(f"the link is gone: {error}") from error
        self.statistics.sent += 1

    def stop_now(self) -> None:
        """Send STOP at once, without waiting for a reply or for whoever holds the link; never raises.

        Whoever holds the link sees the robot end what it does; until then `stop_wanted` has it send STOP again. Safe
        from any thread: it is one frame.
        """
        self.stop_wanted = True
        with contextlib.suppress(LinkDown):
            self.send(Function.COMMAND, pack_command(Op.STOP, STOP_SEQUENCE, self.session))

    def emergency_stop(self) -> None:
        """Send the latched stop of all robots, several times, because nothing acknowledges it; never raises.

        Should all of them be lost, whoever holds the link still stops its trial, as after `stop_now`.
        """
        self.stop_wanted = True
        stop = can.Message(arbitration_id=0, is_extended_id=False, data=b"", check=False)
        for _ in range(ESTOP_FRAMES):
            with contextlib.suppress(Exception):
                self._bus.send(stop)

    def receive(self, timeout_s: float) -> Incoming | None:
        """The next message of this robot, or None after `timeout_s`; heartbeats go out meanwhile.

        Raises:
            LinkDown: the port or adapter is gone.
        """
        with self._lock:  # two readers of one port take each other's bytes
            return self._receive(timeout_s)

    def _receive(self, timeout_s: float) -> Incoming | None:
        deadline = self._clock() + timeout_s
        while True:
            now = self._clock()
            if self._in_charge and now >= self._beat_due_s:
                self._beat(now)
            wait_s = max(0.0, min(deadline - now, self._beat_due_s - now if self._in_charge else HEARTBEAT_S))
            try:
                message = self._bus.recv(wait_s)
            except Exception as error:
                raise LinkDown(f"the link is gone: {error}") from error
            if message is not None and is_ours(message):
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
            elif message is None and self._clock() >= deadline:
                return None

    def _note(self, incoming: Incoming) -> None:
        """Keep what is of interest whoever asked."""
        self._heard_s = self._clock()
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
        return self._clock() - self._heard_s

    def _beat(self, now_s: float) -> None:
        if self._trial_id and now_s - self._heard_s > HEARD_S:
            # soon again, should it be heard meanwhile; at once would be a loop that never sleeps
            self._beat_due_s = now_s + 0.1 * HEARTBEAT_S
            return
        self.send(Function.HOST_HEARTBEAT, host_heartbeat(self._trial_id, self.session))
        self._beat_due_s = now_s + HEARTBEAT_S

    # -- who holds the line -----------------------------------------------------------------------------------------

    def take_charge(self) -> None:
        """Send heartbeats from now on, whoever holds the line."""
        with self._lock:
            self._in_charge, self._beat_due_s = True, 0.0
            if getattr(self._bus, "own_clock", False):
                return  # its time stands still while nobody reads: there is nothing to keep alive
            if self._keeper is None or not self._keeper.is_alive():
                self._keeper = threading.Thread(target=self._keep, name="heartbeat", daemon=True)
                self._keeper.start()

    def let_go(self) -> None:
        """Send none."""
        with self._lock:
            self._in_charge = False

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
            self.let_go()
            try:
                yield
            finally:
                self.take_charge()

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

    def close(self) -> None:
        """End the heartbeats and shut the bus down. May be called twice."""
        self._closing.set()
        if self._keeper is not None:
            self._keeper.join()
        with contextlib.suppress(Exception):
            self._bus.shutdown()

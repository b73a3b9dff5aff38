"""An Aseba node at the end of a line: what it is, its memory, its program, the events in both directions."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Sequence
from types import MappingProxyType

from sceann_hil.firmware.aesl.compiler import Code
from sceann_hil.firmware.aesl.program import EVENTS
from sceann_hil.firmware.aesl.target import NATIVES, THYMIO, Target
from sceann_hil.link.aseba_line import AsebaLine, Message
from sceann_hil.robot import LinkError, RobotFault
from sceann_hil.robot.durations import Durations

PROTOCOL = 5
"""Version that a host asks with, and the oldest that a robot may answer with."""
ANSWER_S = 1.0
"""How long a robot may take to answer."""
_LOOK_S = 0.5
_CHUNK = 200
"""Words of byte code or variables in a message."""
_READ = 40
"""Words that are asked for at once: the wireless module sends no more than 47."""
_WRITE_BYTECODE = 0xA00D
_FAULTS = MappingProxyType(
    {
        0x9006: "it read or wrote beyond an array",
        0x9007: "it divided by zero",
        0x9008: "a handler was interrupted by the next event",
        0x9009: "the robot reported an error",
    }
)


class NoNode(LinkError):
    """The line is there, and no robot on it."""


class AsebaNode:
    """One robot on a line.

    Args:
        line: where it is.
        number: which node, where there are several; None for the only Thymio.

    Attributes:
        answered: how long it took to answer, since this object was made.
    """

    def __init__(self, line: AsebaLine, number: int | None = None) -> None:
        self.line = line
        self.answered = Durations()
        self._wanted = number
        self._number = -1
        self._target: Target | None = None
        self._events: deque[tuple[str, tuple[int, ...]]] = deque()

    @property
    def target(self) -> Target:
        """What it said that it is.

        Raises:
            LinkError: it is not connected.
        """
        if self._target is None:
            raise LinkError(f"{self.line.place}: not connected")
        return self._target

    # -- connection -------------------------------------------------------------------------------------------------

    def connect(self, wait_s: float = 3.0) -> None:
        """Open the line, find the robot and let it describe itself.

        Raises:
            NoNode: no robot answers: it sleeps, is switched off or out of the dongle's reach.
            LinkError: no line, another kind of node, several robots, or firmware that is too old.
        """
        if not self.line.is_open:
            self.line.open()
        self._events.clear()
        try:
            self._number = self._choose(self._present(wait_s))
            self._target = self._described()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Let go; may be called twice."""
        self._target = None
        self.line.close()

    def _present(self, wait_s: float) -> dict[int, int]:
        """Protocol versions of all nodes by their numbers."""
        until_s = time.monotonic() + wait_s
        found: dict[int, int] = {}
        kind = self.line.messages
        while not found and time.monotonic() < until_s:
            self.line.send(kind.ID_LIST_NODES, PROTOCOL)
            ask_again_s = time.monotonic() + _LOOK_S
            while time.monotonic() < ask_again_s:
                message = self.line.receive(0.1)
                if message is not None and message.id == kind.ID_NODE_PRESENT:
                    found[message.source_node] = message.version
                    # others answer at the same time
                    ask_again_s = min(ask_again_s, time.monotonic() + 0.15)
        if not found:
            raise NoNode(
                f"{self.line.place}: no robot answers. It is switched off or asleep (press its centre button for three "
                "seconds), out of reach of the wireless dongle, or not paired with it"
            )
        return found

    def _choose(self, found: dict[int, int]) -> int:
        numbers = sorted(found)
        if self._wanted is not None and self._wanted not in found:
            raise LinkError(f"{self.line.place}: expected node {self._wanted}, found {', '.join(map(str, numbers))}")
        if self._wanted is None and len(numbers) > 1:
            raise LinkError(
                f"{self.line.place}: there are several robots, nodes {', '.join(map(str, numbers))}; expected one, or "
                "its number in robot.node"
            )
        number = numbers[0] if self._wanted is None else self._wanted
        if found[number] < PROTOCOL:
            raise LinkError(
                f"{self.line.place}: the robot's firmware is too old: it speaks version {found[number]} of the Aseba "
                f"protocol, expected {PROTOCOL} or later; update it with Thymio Suite"
            )
        return number

    def _described(self) -> Target:
        kind = self.line.messages
        self.line.send(kind.ID_GET_NODE_DESCRIPTION, self._number)
        whole = self._expect(kind.ID_DESCRIPTION, "to describe itself")
        variables = dict(self._named(kind.ID_NAMED_VARIABLE_DESCRIPTION, whole.num_named_var))
        events = [name for name, _ in self._named(kind.ID_LOCAL_EVENT_DESCRIPTION, whole.num_local_events)]
        functions = [name for name, _ in self._named(kind.ID_NATIVE_FUNCTION_DESCRIPTION, whole.num_native_fun)]
        target = Target(
            whole.node_name,
            whole.bytecode_size,
            whole.max_var_size,
            MappingProxyType(variables),
            tuple(events),
            tuple(functions),
        )
        if target.name != THYMIO.name:
            raise LinkError(f"{self.line.place}: expected a Thymio II (node {THYMIO.name}), found a {target.name}")
        missing = [name for name in ("prox.horizontal", "motor.left.target") if name not in variables]
        missing += [name for name in NATIVES if name not in functions]
        missing += [name for name in ("timer0", "buttons") if name not in events]
        if missing:
            raise LinkError(
                f"{self.line.place}: the robot's firmware is too old: it has no {missing[0]}; update it with Thymio "
                "Suite"
            )
        return target

    def _named(self, kind: int, count: int) -> list[tuple[str, int]]:
        """Names and sizes of `count` things that it describes one by one."""
        found = []
        for _ in range(count):
            message = self._expect(kind, "to describe itself")
            name = {
                self.line.messages.ID_NAMED_VARIABLE_DESCRIPTION: "var_name",
                self.line.messages.ID_LOCAL_EVENT_DESCRIPTION: "event_name",
            }.get(kind, "fun_name")
            found.append((str(getattr(message, name)), int(getattr(message, "var_size", 0))))
        return found

    def firmware(self) -> int:
        """Number of its firmware."""
        return self.read(self.target.address("_fwversion"), 1)[0]

    # -- memory and program -----------------------------------------------------------------------------------------

    def read(self, address: int, length: int) -> tuple[int, ...]:
        """Variables, with signs.

        Raises:
            LinkError: no answer.
        """
        kind = self.line.messages
        words: list[int] = []
        while len(words) < length:
            at, n = address + len(words), min(_READ, length - len(words))
            asked_s = time.monotonic()
            self.line.send(kind.ID_GET_VARIABLES, self._number, at, n)
            while True:
                message = self._expect(kind.ID_VARIABLES, "for its variables")
                if message.var_offset == at:
                    break
            self.answered.add(time.monotonic() - asked_s)
            words += [signed(word) for word in message.var_data[:n]]
        return tuple(words)

    def write(self, address: int, values: Sequence[int]) -> None:
        """Set variables; any thread may.

        Raises:
            LinkError: the line is gone.
        """
        for first in range(0, len(values), _CHUNK):
            part = values[first : first + _CHUNK]
            self.line.send(self.line.messages.ID_SET_VARIABLES, self._number, address + first, *part)

    def load(self, code: Code) -> None:
        """Put a program into its memory and let it run.

        Raises:
            LinkError: no answer.
            RobotFault: the program is not there afterwards.
        """
        kind = self.line.messages
        for first in range(0, len(code.words), _CHUNK):
            self.line.send(kind.ID_SET_BYTECODE, self._number, first, *code.words[first : first + _CHUNK])
        self.line.send(kind.ID_RESET, self._number)
        self.line.send(kind.ID_RUN, self._number)
        # what the beginning of the program says is what its variables must be
        for name, values in code.initial.items():
            if self.read(code.addresses[name], len(values)) != values:
                raise RobotFault(f"{self.line.place}: the robot did not take its program: {name} has other values")
        self._events.clear()

    def keep_program(self) -> None:
        """Let the program outlive a power cut."""
        self.line.send(_WRITE_BYTECODE, self._number)

    def stop_motors(self) -> None:
        """Motor targets to 0, whatever program runs; any thread may.

        Raises:
            LinkError: the line is gone.
        """
        self.tell("sceann.halt")
        if self._target is not None:
            for name in ("motor.left.target", "motor.right.target"):
                self.write(self._target.address(name), [0])

    # -- events -----------------------------------------------------------------------------------------------------

    def tell(self, event: str, *arguments: int) -> None:
        """Send an event; any thread may.

        Raises:
            LinkError: the line is gone.
        """
        self.line.send(EVENTS.index(event), *arguments)

    def heard(self, timeout_s: float) -> tuple[str, tuple[int, ...]] | None:
        """The next event of ours from this robot: name and arguments with signs; None if none came in time.

        Raises:
            LinkError: the line is gone.
            RobotFault: its program was stopped by an error.
        """
        if self._events:
            return self._events.popleft()
        until_s = time.monotonic() + timeout_s
        while True:
            message = self.line.receive(max(until_s - time.monotonic(), 0.0))
            if message is None:
                return None
            self._keep(message)
            if self._events:
                return self._events.popleft()

    def forget_events(self) -> None:
        """Throw away what has been heard so far."""
        while self.heard(0.0) is not None:
            pass

    def _keep(self, message: Message) -> None:
        if message.source_node != self._number:
            return
        if message.id in _FAULTS:
            raise RobotFault(f"{self.line.place}: the robot's program was stopped: {_FAULTS[message.id]}")
        if message.id < len(EVENTS):
            self._events.append((EVENTS[message.id], tuple(map(signed, message.user_event_arg))))

    def _expect(self, kind: int, why: str) -> Message:
        until_s = time.monotonic() + ANSWER_S
        while (left_s := until_s - time.monotonic()) > 0.0:
            message = self.line.receive(left_s)
            if message is not None and message.source_node == self._number:
                if message.id == kind:
                    return message
                self._keep(message)
        raise LinkError(
            f"{self.line.place}: the robot does not answer when it is asked {why}: it sleeps, is out of reach, or its "
            "simulator stands still"
        )


def signed(word: int) -> int:
    """A word as a number with a sign."""
    return word - 0x10000 if word >= 0x8000 else word

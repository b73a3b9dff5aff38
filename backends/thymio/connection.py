"""The way to a Thymio: opened, lost, found again, given its program, and stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sceann_hil.firmware.aesl.compiler import Code
from sceann_hil.firmware.aesl.node import AsebaNode
from sceann_hil.firmware.aesl.program import MEMORY_WORDS, OURS, End, Life, Running
from sceann_hil.firmware.aesl.target import Target
from sceann_hil.link.aseba_line import AsebaLine
from sceann_hil.robot import LinkError

if TYPE_CHECKING:
    from sceann_hil.firmware.emulated.playground import Playground

_STOPS = 3
"""How often a robot is told to stop before it counts as out of reach."""
_ANSWER_S = 0.4
_TRY_AGAIN_S = 0.5


@dataclass(frozen=True, slots=True)
class Done:
    """The last trial that a robot knows of.

    Attributes:
        number: its number; 0 for none.
        end: why it ended.
        steps: that it did.
        state_hash: of all its steps.
    """

    number: int
    end: End
    steps: int
    state_hash: int

    @classmethod
    def told(cls, words: tuple[int, ...]) -> Done:
        """From the robot's own words.

        Raises:
            LinkError: they are none.
        """
        if len(words) != 4 or words[1] not in list(End):
            raise LinkError(f"the robot said of the end of a trial what cannot be: {words}")
        number, end, steps, state_hash = words
        return cls(number & 0xFFFF, End(end), steps & 0xFFFF, state_hash & 0xFFFF)


class Connection:
    """One Thymio, or the makers' simulator of one.

    Args:
        port: serial port; or
        host: name and port of a TCP connection; or
        simulator: starts a simulated robot at a trial's start.
        node: its number, where there are several.
        life: what every program does.
        reconnect_s: how long a robot that does not answer is looked for.

    Attributes:
        lost: it was lost in a trial, and has to be found again before the next.
        last: what it knew of its last trial when it was found.
    """

    def __init__(
        self,
        life: Life,
        *,
        port: str | None = None,
        host: str | None = None,
        simulator: Callable[[dict[str, float]], Playground] | None = None,
        node: int | None = None,
        reconnect_s: float = 10.0,
    ) -> None:
        self.life = life
        self.lost = False
        self.last: Done | None = None
        self._place = port, host
        self._simulator = simulator
        self._playground: Playground | None = None
        self._wanted, self._reconnect_s = node, reconnect_s
        self._node: AsebaNode | None = None
        self._program: tuple[object, Code] | None = None
        self._receiving = threading.RLock()

    @property
    def node(self) -> AsebaNode:
        """The connected robot.

        Raises:
            LinkError: there is none.
        """
        if self._node is None:
            raise LinkError("the Thymio is not connected")
        return self._node

    @property
    def is_connected(self) -> bool:
        """It was found, and not lost since."""
        return self._node is not None and not self.lost

    @property
    def place(self) -> str:
        """Where it is, for messages."""
        port, host = self._place
        return port or host or "asebaplayground"

    # -- found and lost ---------------------------------------------------------------------------------------------

    def open(self, wait_s: float = 3.0) -> None:
        """Find the robot, stop its motors, and ask what it did last.

        Raises:
            LinkError: it is not there, or it is another one.
            ToolMissing: the simulator is not installed.
        """
        with self._receiving:
            self._hang_up()
            port, host = self._place
            if self._simulator is not None:
                if self._playground is None:
                    self._playground = self._simulator({})
                host = self._playground.host
            node = AsebaNode(AsebaLine(port, host), self._wanted)
            node.connect(wait_s)
            self._node, self.lost, self._program = node, False, None
            node.stop_motors()
            self.last = self._remembered()

    def reach(self) -> None:
        """Find a robot that was lost, within the time for it.

        Raises:
            LinkError: it is not to be found.
        """
        if self.is_connected:
            return
        until_s = time.monotonic() + self._reconnect_s
        while True:
            try:
                if self.lost and self._playground is not None:
                    self._end_simulator()
                self.open()
                return
            except LinkError:
                if time.monotonic() >= until_s:
                    raise
                time.sleep(_TRY_AGAIN_S)

    def close(self) -> None:
        """Let go of it; may be called twice."""
        with self._receiving:
            self._hang_up()
            self._end_simulator()

    def _hang_up(self) -> None:
        if self._node is not None:
            self._node.close()
        self._node = None

    def _end_simulator(self) -> None:
        if self._playground is not None:
            self._playground.close()
        self._playground = None

    def put_at(self, start: dict[str, float]) -> None:
        """The robot at a trial's start: a simulator is started anew there, a real robot was put there by somebody.

        Raises:
            LinkError: the simulator does not start.
        """
        if self._simulator is None:
            return
        with self._receiving:
            self._hang_up()
            self._end_simulator()
            self._playground = self._simulator(start)
        self.open()

    # -- programs and stops -----------------------------------------------------------------------------------------

    def load(self, name: object, make: Callable[[Target], Code]) -> Code:
        """Make sure that a program is in the robot.

        Args:
            name: what tells it from others.
            make: compiles it for this robot.

        Raises:
            LinkError: no answer.
            RobotFault: the robot did not take it.
            ValueError: it does not fit.
        """
        with self._receiving:
            if self._program is None or self._program[0] != name:
                code = make(self.node.target)
                self._program = None
                self.node.load(code)
                self._program = name, code
            return self._program[1]

    @contextmanager
    def listening(self) -> Iterator[AsebaNode]:
        """The robot, for whoever listens to it; nobody else does meanwhile."""
        with self._receiving:
            yield self.node

    def stop(self) -> bool:
        """Stop the motors, again until the robot answers; a robot out of reach stops by itself.

        Returns:
            True if the robot answered, False if it did not or somebody else listens to it.
        """
        node = self._node
        if node is None or self.lost:
            return False
        with suppress(LinkError):
            node.stop_motors()
            if not self._receiving.acquire(blocking=False):
                # whoever listens hears the answer
                return True
            try:
                for _ in range(_STOPS):
                    until_s = time.monotonic() + _ANSWER_S
                    while (left_s := until_s - time.monotonic()) > 0.0:
                        event = node.heard(left_s)
                        if event is not None and event[0] == "sceann.done":
                            return True
                    if self._still():
                        return True
                    node.stop_motors()
            finally:
                self._receiving.release()
        self.lost = True
        return False

    def _still(self) -> bool:
        """A robot without a program of ours does not answer a halt: its motors' targets say it."""
        target = self.node.target
        return not any(self.node.read(target.address(f"motor.{side}.target"), 1)[0] for side in ("left", "right"))

    def _remembered(self) -> Done | None:
        words = self.node.read(self.node.target.free_from, MEMORY_WORDS)
        if words[0] != OURS or words[1] not in list(Running):
            return None
        with suppress(LinkError):
            return Done.told(words[-4:])
        return None

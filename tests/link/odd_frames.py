"""A bus on which, before every true frame, some arrive that pass the check and mean something else or nothing."""

from __future__ import annotations

from collections import Counter, deque
from typing import Any

import can
import numpy as np

from sceann_hil.link.vocabulary import Function

FUNCTIONS = tuple(Function)


class OddFrames(can.BusABC):
    """A robot's bus, with frames that a chance check sum, newer firmware or another device could have sent.

    Attributes:
        injected: odd frames so far, by the function that they claim.

    Args:
        bus: the robot's.
        rng: draws them.
        at_once: its only element: how many come before every true frame, about; may be changed at any time.
        node: the robot's number, which they all bear.
    """

    def __init__(self, bus: can.BusABC, rng: np.random.Generator, at_once: list[float], node: int = 1) -> None:
        self.injected: Counter[int] = Counter()
        self._at_once = at_once
        self._inner = bus
        self._rng = rng
        self._node = node
        self._queue: deque[can.Message] = deque()
        self.channel_info = "odd frames"

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._inner.send(msg, timeout)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        if not self._queue:
            true = self._inner.recv(timeout)
            if true is None:
                return None
            self._queue += [self._odd(true) for _ in range(self._rng.poisson(self._at_once[0]))]
            self._queue.append(true)
        return self._queue.popleft()

    def _odd(self, true: can.Message) -> can.Message:
        """The true frame with some bits of it wrong, or any bytes under any function."""
        if self._rng.random() < 0.5:
            data = bytearray(true.data)
            for _ in range(self._rng.integers(1, 4)):
                if data:
                    data[self._rng.integers(len(data))] ^= 1 << self._rng.integers(8)
            function = true.arbitration_id & 0x780
        else:
            function = int(self._rng.choice(FUNCTIONS))
            data = bytearray(self._rng.bytes(int(self._rng.integers(0, 9))))
        self.injected[function] += 1
        return can.Message(arbitration_id=function | self._node, is_extended_id=False, data=bytes(data))

    def shutdown(self) -> None:
        self._inner.shutdown()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._inner, name)

"""A link whose port others use too: devices on the same bus, threads of the same host."""

from __future__ import annotations

import threading
import time

import can

from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.link.session import RobotLink
from sceann_hil.link.vocabulary import Function, State


def test_frames_that_are_none_of_the_links_are_counted_and_ignored() -> None:
    """Somebody else's device on the same CAN bus may use the robot's identifiers for something else."""
    with can.Bus(interface="virtual", channel="shared") as other:
        link = RobotLink(can.Bus(interface="virtual", channel="shared"))
        for function in (Function.HEARTBEAT, Function.EVENT, Function.END):
            data = b"\xc8" * (7 if function is Function.END else 8)
            other.send(can.Message(arbitration_id=function + 1, is_extended_id=False, data=data))
        assert link.receive(0.2) is None
        assert link.statistics.foreign == 3
        link.close()


def test_a_link_goes_on_among_foreign_frames() -> None:
    with VirtualPosix(None) as board:
        link = RobotLink(can.Bus(interface="sceann_serial", channel=board.port))
        assert link.hello().name
        deadline = time.monotonic() + 5.0
        while link.state is None and time.monotonic() < deadline:
            link.receive(0.2)
        assert link.state is State.IDLE
        link.close()


class CountingBus:
    """A bus that notices when two read it at once."""

    def __init__(self) -> None:
        self.readers = 0
        self.most_readers = 0

    def recv(self, timeout: float) -> None:
        self.readers += 1
        self.most_readers = max(self.most_readers, self.readers)
        time.sleep(timeout)
        self.readers -= 1

    def shutdown(self) -> None:
        """Nothing to do."""


def test_two_threads_never_read_a_port_at_once() -> None:
    """Regression: the doctor listened while the heartbeat thread did, and a healthy robot's port was called gone."""
    bus = CountingBus()
    link = RobotLink(bus)  # type: ignore[arg-type]
    threads = [threading.Thread(target=lambda: [link.receive(0.02) for _ in range(3)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert bus.most_readers == 1
    link.close()

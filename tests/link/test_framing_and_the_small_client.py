"""Serial frames, and the two readings of the link: this package's, and the small client's of `sceann_hil.firmware`.

The small client packs with cantools from the DBC and works on chips whose time is simulated; this package packs with
`struct` and works on every python-can bus. Neither may say anything that the other does not understand.
"""

from __future__ import annotations

import threading
import time

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from backends.emulation.virtual_posix import VirtualPosix
from backends.link import framing, messages
from backends.link.session import RobotLink
from sceann_hil.firmware import client

identifiers = st.integers(0, 0x7FF)
payloads = st.binary(max_size=8)


@given(frames=st.lists(st.tuples(identifiers, payloads), max_size=5), cut=st.integers(0, 80))
def test_frames_come_out_as_they_went_in_however_the_stream_is_cut(frames: list[tuple[int, bytes]], cut: int) -> None:
    stream = b"".join(framing.encode_frame(*frame) for frame in frames)
    deframer = framing.Deframer()
    assert deframer.feed(stream[:cut]) + deframer.feed(stream[cut:]) == frames
    assert deframer.broken == 0


@settings(derandomize=True)
@given(identifier=identifiers, data=payloads, place=st.integers(0, 13), bit=st.integers(0, 7))
def test_a_flipped_bit_never_becomes_another_message(identifier: int, data: bytes, place: int, bit: int) -> None:
    frame = bytearray(framing.encode_frame(identifier, data))
    frame[place % len(frame)] ^= 1 << bit
    follow = [(0x101, b"next"), (0x102, b"after")]
    found = framing.Deframer().feed(bytes(frame) + b"".join(framing.encode_frame(*one) for one in follow))
    assert [got for got in found if got not in follow] == []
    assert found[-1] == follow[-1]


def test_noise_without_a_delimiter_does_not_pile_up() -> None:
    deframer = framing.Deframer()
    for _ in range(100):
        assert deframer.feed(b"\x55" * 100) == []
    assert len(deframer._rest) <= framing.LONGEST_FRAME
    deframer.feed(framing.DELIMITER)
    assert deframer.feed(framing.encode_frame(5, b"x")) == [(5, b"x")]


@given(identifier=identifiers, data=payloads)
def test_both_readings_have_the_same_frames(identifier: int, data: bytes) -> None:
    frame = framing.encode_frame(identifier, data)
    assert client.encode_frame(identifier, data) == frame
    assert client.decode_frame(frame[:-1]) == framing.decode_frame(frame[:-1]) == (identifier, data)


@pytest.mark.parametrize("name", ["Op", "Status", "Mode", "Telemetry"])
def test_both_readings_have_the_same_numbers(name: str) -> None:
    ours, theirs = getattr(messages, name), getattr(client, name)
    assert {member.name: member.value for member in ours} == {member.name: member.value for member in theirs}


def test_frames_that_are_none_of_the_links_are_counted_and_ignored() -> None:
    """Somebody else's device on the same CAN bus may use the robot's identifiers for something else."""
    with can.Bus(interface="virtual", channel="shared") as other:
        link = RobotLink(can.Bus(interface="virtual", channel="shared"))
        for function in (messages.Function.HEARTBEAT, messages.Function.EVENT, messages.Function.END):
            data = b"\xc8" * (7 if function is messages.Function.END else 8)
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
        assert link.state is messages.State.IDLE
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

"""Frames on a serial line."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from sceann_hil.link import framing

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

"""A CAN frame on a serial line: ``COBS(id:u16le data[0..8] crc16:be) 00``."""

from __future__ import annotations

import binascii

from cobs import cobs  # type: ignore[import-untyped]

DELIMITER = b"\0"
LONGEST_FRAME = 14
"""Bytes on the line of a frame with eight data bytes, delimiter included."""


def encode_frame(identifier: int, data: bytes) -> bytes:
    """The bytes of one frame, delimiter included."""
    raw = identifier.to_bytes(2, "little") + data
    return bytes(cobs.encode(raw + binascii.crc_hqx(raw, 0xFFFF).to_bytes(2, "big"))) + DELIMITER


def decode_frame(frame: bytes) -> tuple[int, bytes] | None:
    """Identifier and data of a frame without its delimiter; None if it is not whole and right."""
    try:
        raw = cobs.decode(frame)
    except cobs.DecodeError:
        return None
    if not 4 <= len(raw) <= 12 or binascii.crc_hqx(raw, 0xFFFF) != 0:
        return None
    return raw[0] | raw[1] << 8, raw[2:-2]


class Deframer:
    """Cuts a byte stream into frames.

    Attributes:
        broken: frames dropped because their check failed.
    """

    def __init__(self) -> None:
        self.broken = 0
        self._rest = b""

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """The frames that these bytes complete."""
        *frames, self._rest = (self._rest + data).split(DELIMITER)
        if len(self._rest) > LONGEST_FRAME:
            # no frame is so long: keep its tail, so that noise without a delimiter does not pile up
            self._rest = self._rest[-LONGEST_FRAME:]
        found = []
        for frame in frames:
            if frame:
                decoded = decode_frame(frame)
                if decoded is None:
                    self.broken += 1
                else:
                    found.append(decoded)
        return found

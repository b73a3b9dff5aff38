"""States as bytes: a versioned header with the sizes, then plain arrays. Equal states give equal bytes.

Layout (little-endian): 4 bytes name of the algorithm, uint16 version, uint16 values per locus, uint32
population, uint32 L; then the arrays one after the other in C order, arrays of bits packed eight to a byte.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Bits

_HEADER = struct.Struct("<4sHHII")


@dataclass(frozen=True, slots=True)
class Header:
    """What the bytes hold: the algorithm's name (up to 4 letters), the version of its layout, the sizes."""

    name: str
    version: int
    cap: int
    population: int
    genome_length: int

    def pack(self) -> bytes:
        """The header's bytes."""
        return _HEADER.pack(self.name.encode(), self.version, self.cap, self.population, self.genome_length)


def pack_bits(bits: Bits) -> bytes:
    """Eight bits to a byte, first bit first, padded with zero bits."""
    return np.packbits(bits).tobytes()


class Reader:
    """Takes arrays from the bytes of a state, one after the other.

    Args:
        data: what a `dump` wrote.
        expected: the header that it must have.

    Raises:
        ValueError: another header, or (from the methods) too few or too many bytes.
    """

    def __init__(self, data: bytes, expected: Header) -> None:
        if len(data) < _HEADER.size:
            raise ValueError(f"state: expected at least {_HEADER.size} bytes, got {len(data)}")
        name, *numbers = _HEADER.unpack_from(data)
        got = Header(name.rstrip(b"\0").decode("ascii", "replace"), *numbers)
        if got != expected:
            raise ValueError(f"state: expected a dump with {expected}, got {got}")
        self._data = data
        self._position = _HEADER.size

    def _take(self, size: int) -> bytes:
        end = self._position + size
        if end > len(self._data):
            raise ValueError(f"state: expected at least {end} bytes, got {len(self._data)} (truncated?)")
        taken = self._data[self._position : end]
        self._position = end
        return taken

    def bits(self, shape: Sequence[int]) -> Bits:
        """An array that `pack_bits` wrote."""
        count = int(np.prod(shape))
        packed = np.frombuffer(self._take((count + 7) // 8), dtype=np.uint8)
        return np.unpackbits(packed, count=count).reshape(shape)

    def array(self, dtype: str, shape: Sequence[int]) -> NDArray[Any]:
        """A plain array of little-endian `dtype`, in the machine's byte order."""
        kind = np.dtype(dtype)
        raw = np.frombuffer(self._take(int(np.prod(shape)) * kind.itemsize), dtype=kind)
        return raw.astype(kind.newbyteorder("=")).reshape(shape)

    def finish(self) -> None:
        """Refuse bytes that nobody read."""
        if self._position != len(self._data):
            raise ValueError(f"state: expected {self._position} bytes, got {len(self._data)}")


def checked_parents(parents: NDArray[np.int32]) -> NDArray[np.int32]:
    """`parents` if every entry is -1 (none) or an individual; ValueError otherwise."""
    if parents.size and not (parents.min() >= -1 and parents.max() < parents.size):
        raise ValueError(f"state: expected parents from -1 to {parents.size - 1}, got {parents.tolist()}")
    return parents


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """`array` itself, locked: a state never changes."""
    array.flags.writeable = False
    return array

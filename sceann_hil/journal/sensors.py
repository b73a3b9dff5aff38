"""How a journal keeps what a real robot's sensors read: with it and the genome every neuron can be computed again."""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

TRACE_FORMAT = "sensors uint16le zlib 1"
"""Wire values, shape ``(n_steps, n_sensors)``, row after row, compressed."""


def pack_sensors(sensors: NDArray[np.uint16]) -> bytes:
    """Wire values of shape ``(n_steps, n_sensors)`` as the journal keeps them."""
    return zlib.compress(sensors.astype("<u2").tobytes())


def unpack_sensors(data: bytes, n_sensors: int) -> NDArray[np.uint16]:
    """The inverse of `pack_sensors`.

    Raises:
        ValueError: the data are not whole rows of `n_sensors` values.
    """
    return np.frombuffer(zlib.decompress(data), "<u2").reshape(-1, n_sensors).astype(np.uint16)

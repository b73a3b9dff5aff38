"""How a journal keeps what could not be computed again: a real robot's sensors, and its body's state if that is known.

With the sensors and the genome every neuron can be computed again (`sceann_hil.run.replay.trace_from_sensors`).
"""

from __future__ import annotations

import re
import zlib

import numpy as np
from numpy.typing import NDArray

from sceann_hil.robot import Trace

_FORMAT = re.compile(r"sensors uint16le (\d+), state float32le (\d+), zlib, 1")


def pack_sensor_trace(trace: Trace) -> tuple[str, bytes]:
    """The format, and sensors then states row after row, compressed."""
    text = f"sensors uint16le {trace.sensors.shape[1]}, state float32le {trace.state.shape[1]}, zlib, 1"
    return text, zlib.compress(trace.sensors.astype("<u2").tobytes() + trace.state.astype("<f4").tobytes())


def unpack_sensor_trace(text: str, data: bytes) -> tuple[NDArray[np.uint16], NDArray[np.float32]]:
    """The inverse of `pack_sensor_trace`: sensors ``(n, n_sensors)`` and states ``(n + 1, n_state)``.

    Raises:
        ValueError: another format, or data that do not fill whole rows.
    """
    match = _FORMAT.fullmatch(text)
    if match is None:
        raise ValueError(f"trace: expected sensors and states of format 1, got {text!r}")
    n_sensors, n_state = int(match[1]), int(match[2])
    raw = zlib.decompress(data)
    steps, rest = divmod(len(raw) - 4 * n_state, 2 * n_sensors + 4 * n_state)
    if steps < 0 or rest:
        raise ValueError(
            f"trace: expected whole rows of {n_sensors} sensors and {n_state} states, got {len(raw)} bytes"
        )
    sensors = np.frombuffer(raw, "<u2", steps * n_sensors).reshape(steps, n_sensors)
    states = np.frombuffer(raw, "<f4", offset=sensors.nbytes).reshape(steps + 1, n_state)
    return sensors.astype(np.uint16), states.astype(np.float32)

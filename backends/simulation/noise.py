"""Counter-based noise: the same (key, step, channel) gives the same number, whatever else is simulated beside it.

Bits come from two rounds of the 32-bit finaliser "lowbias32" (C. Wellons, hash-prospector, 2018) over counter and
key; normal deviates from the Box-Muller transform.
"""

from __future__ import annotations

import numpy as np

from backends.simulation.maths import TWO_PI, cosine, logarithm_of_mantissa, sine
from sceann_hil.network.compiled import compiled_part

_F = np.float32
_U = np.uint32
CHANNELS = 64
"""Channels that one step of one trial may use."""


@compiled_part
def _mix(h: np.uint32) -> np.uint32:
    h = _U(h ^ _U(h >> _U(16)))
    h = _U(h * _U(0x7FEB352D))
    h = _U(h ^ _U(h >> _U(15)))
    h = _U(h * _U(0x846CA68B))
    return _U(h ^ _U(h >> _U(16)))


@compiled_part
def random_bits(key_low: np.uint32, key_high: np.uint32, counter: np.uint32) -> np.uint32:
    """32 bits for one counter value of one key."""
    return _mix(_U(_mix(_U(_U(counter * _U(0x9E3779B9)) + key_low)) ^ key_high))


@compiled_part
def normal_pair(key_low: np.uint32, key_high: np.uint32, counter: np.uint32) -> tuple[np.float32, np.float32]:
    """Two independent standard normal deviates; uses `counter` and `counter` + 1."""
    a = random_bits(key_low, key_high, counter)
    b = random_bits(key_low, key_high, _U(counter + _U(1)))
    # 1 <= n <= 2^24 stands for the uniform n / 2^24 in (0, 1]; its logarithm is split as log(mantissa) + exponent log 2
    n = _F(np.int32(_U(a >> _U(8)) + _U(1)))
    bits = n.view(np.int32)
    exponent = _F((bits >> np.int32(23)) - np.int32(127 + 24))
    mantissa = np.int32((bits & np.int32(0x7FFFFF)) | np.int32(0x3F800000)).view(np.float32)
    log_uniform = logarithm_of_mantissa(mantissa - _F(1.0)) + exponent * _F(0.693147181)
    radius = np.sqrt(max(_F(-2.0) * log_uniform, _F(0.0)))
    turn = _F(np.int32(_U(b >> _U(8)))) * _F(1.0 / (1 << 24)) - _F(0.5)
    angle = turn * TWO_PI
    return radius * cosine(angle), radius * sine(angle)

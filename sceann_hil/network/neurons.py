"""SCEANN-Q10 over lanes: bit for bit the neuron of `sceann_hil.network.controller`, `LANES` networks at a time.

Every function is a plain loop over lanes, one lane per element, which the compiler turns into vector code. Sums stay
in int16: with at most 23 sources none can overflow.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.compiled import compiled_part
from sceann_hil.network.controller import THRESHOLD, sigmoid_table

LANES = 64
"""Trials side by side: enough that the compiler keeps the loops as loops and fills the widest vectors."""

_I2 = np.int16
_I4 = np.int32
_U2 = np.uint16
_NODES = sigmoid_table().astype(np.int32)
# value and slope in one word, so that a lane needs one look-up
_TABLE = (_NODES[:129] << 8) | (_NODES[1:] - _NODES[:129])

Int16Lanes = NDArray[np.int16]


@compiled_part
def update_states(
    u: Int16Lanes, resets: Int16Lanes, weights: Int16Lanes, sources: Int16Lanes, memoryless: bool
) -> None:
    """u += net (memoryless: u = net) for all neurons, from the sources as they were, with the refractory reset.

    Args:
        u: states, shape ``(n_neurons, LANES)``, updated.
        resets: 1 where a neuron was reset, else 0; shape ``(n_neurons, LANES)``, written.
        weights: shape ``(n_neurons, n_sources, LANES)``.
        sources: Q10 values, shape ``(n_sources, LANES)``.
        memoryless: which reading of Eq. (1).
    """
    n_neurons, n_sources, _ = weights.shape
    for i in range(n_neurons):
        if memoryless:
            for lane in range(LANES):
                u[i, lane] = _I2(0)
        for j in range(n_sources):
            for lane in range(LANES):
                u[i, lane] = _I2(u[i, lane] + _I2(weights[i, j, lane] * sources[j, lane]))
        for lane in range(LANES):
            state = u[i, lane]
            reset = state > THRESHOLD or state < -THRESHOLD
            u[i, lane] = _I2(0) if reset else state
            resets[i, lane] = _I2(1) if reset else _I2(0)


@compiled_part
def update_outputs(u: Int16Lanes, resets: Int16Lanes, outputs: Int16Lanes, memoryless: bool) -> None:
    """x = f(u) by table interpolation; a memoryless neuron that was reset outputs 0. Shapes as in `update_states`."""
    for i in range(u.shape[0]):
        for lane in range(LANES):
            outputs[i, lane] = interpolate(u[i, lane])
        if memoryless:
            for lane in range(LANES):
                outputs[i, lane] = _I2(0) if resets[i, lane] else outputs[i, lane]


@compiled_part
def interpolate(state: np.int16) -> np.int16:
    """f(u) of one state, -8192..8192."""
    z = _I4(_I4(state) + _I4(THRESHOLD))
    entry = _TABLE[np.uint32(z) >> np.uint32(7)]
    rise = _I4(_I4(entry & _I4(255)) * _I4(z & _I4(127)))
    return _I2(_I4(entry >> _I4(8)) + _I4(_I4(rise + _I4(64)) >> _I4(7)))


@compiled_part
def update_hashes(u: Int16Lanes, hashes: NDArray[np.uint16]) -> None:
    """Continue each lane's CRC-16 (polynomial 0x1021) with its states as little-endian int16."""
    for i in range(u.shape[0]):
        for lane in range(LANES):
            hashes[lane] = hashed(hashes[lane], u[i, lane])


@compiled_part
def hashed(crc: np.uint16, state: np.int16) -> np.uint16:
    """The CRC-16 after one more state."""
    word = _U2(state)
    return _crc_byte(_crc_byte(crc, _U2(word & _U2(255))), _U2(word >> _U2(8)))


@compiled_part
def _crc_byte(crc: np.uint16, byte: np.uint16) -> np.uint16:
    x = _U2(_U2(crc >> _U2(8)) ^ byte)
    x = _U2(x ^ _U2(x >> _U2(4)))
    return _U2(_U2(_U2(crc << _U2(8)) ^ _U2(x << _U2(12))) ^ _U2(_U2(x << _U2(5)) ^ x))

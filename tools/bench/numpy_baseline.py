"""Pole balancing as one writes it by hand in NumPy: all trials at once, finished ones taken out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.controller import THRESHOLD, sigmoid_table


def balance(weights: NDArray[np.int8], start_rad: float, max_steps: int) -> NDArray[np.int32]:
    """Steps that each network balances; two sensors, one motor, the accumulating neuron in SCEANN-Q10.

    Args:
        weights: shape ``(n, n_neurons, n_sources)``.
        start_rad: initial angle.
        max_steps: step limit.

    Returns:
        Steps until the end of each trial, shape ``(n,)``.
    """
    n, n_neurons, _ = weights.shape
    table = sigmoid_table().astype(np.int32)
    f = np.float32
    w = weights.astype(np.int32)
    u, x = np.zeros((n, n_neurons), np.int32), np.full((n, n_neurons), 512, np.int32)
    state = np.zeros((4, n), f)
    state[2] = start_rad
    alive, steps = np.arange(n), np.zeros(n, np.int32)
    limit = f(np.deg2rad(36.0))
    for step in range(1, max_steps + 1):
        scaled = np.stack([(state[0] + f(2.4)) / f(4.8), (state[2] + limit) / (f(2.0) * limit)], axis=1)
        r = (np.clip(scaled, 0, 1) * f(1023) + f(0.5)).astype(np.int32)
        sources = np.concatenate([r + (r >> 9), x], axis=1)
        u += np.einsum("nij,nj->ni", w, sources)
        u[np.abs(u) > THRESHOLD] = 0
        z = u + THRESHOLD
        k = z >> 7
        x = table[k] + (((table[k + 1] - table[k]) * (z & 127) + 64) >> 7)
        force = f(10) * (f(2) * x[:, -1].astype(f) / f(1024) - f(1))
        s, c = np.sin(state[2]), np.cos(state[2])
        thrust = (force + f(0.05) * state[3] ** 2 * s) / f(1.1)
        angular = (f(9.8) * s - c * thrust) / (f(0.5) * (f(4 / 3) - f(0.1) * c * c / f(1.1)))
        linear = thrust - f(0.05) * angular * c / f(1.1)
        state = state + f(0.02) * np.stack([state[1], linear, state[3], angular])
        steps[alive] = step
        keep = (np.abs(state[0]) <= f(2.4)) & (np.abs(state[2]) <= limit)
        if not keep.all():
            alive, state, u, x, w = alive[keep], state[:, keep], u[keep], x[keep], w[keep]
        if len(alive) == 0:
            break
    return steps

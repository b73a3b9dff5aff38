"""A robot that sees: seven infrared sensors, four walls, three obstacles; ours against hand-vectorised NumPy."""

from __future__ import annotations

import time

import numpy as np
from figures import Figure, median_s
from numpy.typing import NDArray
from simulation import one_each

from backends.world.body import WorldDrive
from backends.world.layout import Box, Infrared, Motion, Round, Senses, World
from sceann_hil.network.coding import Coding, NetworkSize, Weights
from sceann_hil.network.controller import THRESHOLD, sigmoid_table

SIZE = NetworkSize(7, 2, 2)
RADIUS, RANGE, STEP, STEPS = 0.0275, 0.1, 0.015, 200
DIRECTIONS = np.deg2rad([-90.0, -50.0, -20.0, 0.0, 20.0, 50.0, 90.0])
ROUNDS = (Round((0.3, 0.3), 0.05), Round((0.7, 0.6), 0.08))
BOX = Box((0.5, 0.8), (0.2, 0.1), 0.3)


def run() -> list[Figure]:
    """The same random genomes from the same starts, on one core."""
    weights, starts = _genomes(20_000)
    senses = Senses(tuple(Infrared((RADIUS * np.cos(a), RADIUS * np.sin(a)), float(a), RANGE) for a in DIRECTIONS))
    world = World((1.0, 1.0), rounds=ROUNDS, boxes=(BOX,))
    robot = WorldDrive(world, senses, Motion(STEP, RADIUS, 2 * RADIUS), 0.1, threads=1)
    trials = one_each(SIZE, weights, starts, STEPS)
    steps = int(robot.run(trials).steps.sum())
    some = 4_000
    # turn by turn: what else the machine does meets both
    turns = [
        (
            median_s(lambda: robot.run(trials), 1, time.thread_time),
            median_s(lambda: drive(weights[:some], starts[:some]), 1, time.thread_time),
        )
        for _ in range(3)
    ]
    ours_s, numpy_s = np.median(turns, axis=0).tolist()
    ours, numpy_rate = steps / ours_s, some * STEPS / numpy_s
    ratio = ours / numpy_rate
    return [
        Figure("7 infrared sensors, 4 walls, 3 obstacles", f"{ours / 1e6:.1f} million steps/s", ">= 20", ours >= 20e6),
        Figure("hand-vectorised NumPy", f"{numpy_rate / 1e6:.2f} million steps/s"),
        Figure("ours / NumPy", f"{ratio:.0f} x", ">= 20 x", ratio >= 20.0),
    ]


def drive(weights: Weights, starts: NDArray[np.float64]) -> NDArray[np.float32]:
    """All trials side by side, step by step, as one writes it by hand; where they end, shape ``(3, n)``."""
    f = np.float32
    n, n_neurons, _ = weights.shape
    table, w = sigmoid_table().astype(np.int32), weights.astype(np.int32)
    u, x = np.zeros((n, n_neurons), np.int32), np.full((n, n_neurons), 512, np.int32)
    px, py, heading = starts.T.astype(f)
    turn = DIRECTIONS.astype(f)[:, None]
    for _ in range(STEPS):
        angle = heading + turn
        dx, dy = np.cos(angle), np.sin(angle)
        ox, oy = px + f(RADIUS) * dx, py + f(RADIUS) * dy
        near = np.minimum(_to_walls(ox, dx), _to_walls(oy, dy))
        for it in ROUNDS:
            near = np.minimum(near, _to_round(ox, oy, dx, dy, it))
        near = np.minimum(near, _to_box(ox, oy, dx, dy))
        reading = f(1) - np.clip(near, 0, f(RANGE)) / f(RANGE)
        r = (reading.T * f(1023) + f(0.5)).astype(np.int32)
        u += np.einsum("nij,nj->ni", w, np.concatenate([r + (r >> 9), x], axis=1))
        u[np.abs(u) > THRESHOLD] = 0
        z = u + THRESHOLD
        k = z >> 7
        x = table[k] + (((table[k + 1] - table[k]) * (z & 127) + 64) >> 7)
        left, right = (f(STEP) * (f(2) * x[:, i].astype(f) / f(1024) - f(1)) for i in (-2, -1))
        forward = f(0.5) * (left + right)
        px, py = px + forward * np.cos(heading), py + forward * np.sin(heading)
        heading = heading + (right - left) / f(2 * RADIUS)
        for it in ROUNDS:
            px, py = _out_of_round(px, py, it)
        px, py = _out_of_box(px, py)
        px, py = np.clip(px, f(RADIUS), f(1 - RADIUS)), np.clip(py, f(RADIUS), f(1 - RADIUS))
    return np.stack([px, py, heading])


Floats = NDArray[np.float32]


def _to_walls(o: Floats, d: Floats) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(((d > 0) - o) / d, nan=1e9))


def _to_round(ox: Floats, oy: Floats, dx: Floats, dy: Floats, it: Round) -> Floats:
    tx, ty = np.float32(it.at_m[0]) - ox, np.float32(it.at_m[1]) - oy
    along = tx * dx + ty * dy
    rest = np.float32(it.radius_m**2) - (tx * tx + ty * ty - along * along)
    t = along - np.sqrt(np.maximum(rest, 0))
    return np.where((rest >= 0) & (t >= 0), t, np.float32(1e9))


def _to_box(ox: Floats, oy: Floats, dx: Floats, dy: Floats) -> Floats:
    c, s = np.float32(np.cos(BOX.angle_rad)), np.float32(np.sin(BOX.angle_rad))
    rx, ry = ox - np.float32(BOX.at_m[0]), oy - np.float32(BOX.at_m[1])
    px, py, qx, qy = c * rx + s * ry, c * ry - s * rx, c * dx + s * dy, c * dy - s * dx
    hx, hy = np.float32(BOX.size_m[0] / 2), np.float32(BOX.size_m[1] / 2)
    with np.errstate(divide="ignore", invalid="ignore"):
        ax, bx, ay, by = (-hx - px) / qx, (hx - px) / qx, (-hy - py) / qy, (hy - py) / qy
    enters = np.maximum(np.minimum(ax, bx), np.minimum(ay, by))
    leaves = np.minimum(np.maximum(ax, bx), np.maximum(ay, by))
    return np.where((enters <= leaves) & (leaves >= 0), np.maximum(enters, 0), np.float32(1e9))


def _out_of_round(px: Floats, py: Floats, it: Round) -> tuple[Floats, Floats]:
    dx, dy = px - np.float32(it.at_m[0]), py - np.float32(it.at_m[1])
    away, reach = np.sqrt(dx * dx + dy * dy), np.float32(it.radius_m + RADIUS)
    scale = np.where(away < reach, reach / np.maximum(away, np.float32(1e-6)), np.float32(1))
    return np.float32(it.at_m[0]) + dx * scale, np.float32(it.at_m[1]) + dy * scale


def _out_of_box(px: Floats, py: Floats) -> tuple[Floats, Floats]:
    c, s = np.float32(np.cos(BOX.angle_rad)), np.float32(np.sin(BOX.angle_rad))
    rx, ry = px - np.float32(BOX.at_m[0]), py - np.float32(BOX.at_m[1])
    x, y = c * rx + s * ry, c * ry - s * rx
    hx, hy = np.float32(BOX.size_m[0] / 2), np.float32(BOX.size_m[1] / 2)
    nx, ny = np.clip(x, -hx, hx), np.clip(y, -hy, hy)
    away = np.hypot(x - nx, y - ny)
    scale = np.where(
        (away < RADIUS) & (away > 0), np.float32(RADIUS) / np.maximum(away, np.float32(1e-6)), np.float32(1)
    )
    x, y = nx + (x - nx) * scale, ny + (y - ny) * scale
    return np.float32(BOX.at_m[0]) + c * x - s * y, np.float32(BOX.at_m[1]) + s * x + c * y


def _genomes(n: int) -> tuple[Weights, NDArray[np.float64]]:
    rng = np.random.default_rng(0)
    bits = rng.integers(0, 2, (n, Coding.SCEANN3.genome_length(SIZE)), dtype=np.uint8)
    starts = np.column_stack([np.full(n, 0.5), np.full(n, 0.45), rng.uniform(-np.pi, np.pi, n)])
    return Coding.SCEANN3.decode(bits, SIZE), starts

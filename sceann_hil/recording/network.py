"""The controller as a drawing: sensors left, hidden neurons in the middle, motors right, every connection visible.

Solid blue is excitatory, dashed red is inhibitory, as in the paper's Figures 8 and 12. The network is recurrent and
fully interconnected, so connections inside a layer and backwards are arcs that bow to their left (a pair of opposite
connections never coincides) and self connections are loops. Arrow heads show the direction.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from sceann_hil.coding import NetworkSize, Weights
from sceann_hil.controller import ONE, sensors_to_q10
from sceann_hil.recording import style
from sceann_hil.recording.columns import several, static, step_times, timed
from sceann_hil.recording.trial import RecordedRun, RecordedTrial

BOUNDS = ((-2.3, 12.0), (-5.3, 5.3))
"""What a view of the network should show: x range, y range (y points down)."""

_NODE_RADIUS = 0.32
_LINE_RADIUS = 0.028
_COLUMN_X = (0.0, 5.0, 10.0)
_CURVE = np.linspace(0.0, 1.0, 17)
_HEAD_LENGTH, _HEAD_HALF_WIDTH = 0.30, 0.13
_DASH, _GAP = 0.26, 0.20

Points = NDArray[np.float64]


def layout(size: NetworkSize) -> Points:
    """Where the sources are drawn, in the order sensors, hidden, motors; shape ``(n_sources, 2)``."""
    columns = []
    for x, count, spacing in zip(
        _COLUMN_X, (size.n_sensors, size.n_hidden, size.n_motors), (1.35, 2.6, 3.2), strict=True
    ):
        spacing = min(spacing, 8.6 / max(count - 1, 1))
        y = (np.arange(count) - (count - 1) / 2) * spacing
        # a column of hidden neurons leans out, so that connections past a neighbour do not run through it
        lean = np.where(np.arange(count) % 2, 0.55, -0.55) if x == _COLUMN_X[1] and count > 2 else 0.0
        columns.append(np.column_stack([np.full(count, x) + lean, y]))
    return np.concatenate(columns)


def network_scenery(run: RecordedRun) -> Iterator[Chunk]:
    """The nodes' names: the same for all trials."""
    positions = layout(run.size)
    names = [*run.sensor_names, *run.hidden_names, *run.motor_names]
    n_sensors = run.size.n_sensors
    offset = np.tile([0.0, 0.82], (len(positions), 1))
    offset[:n_sensors] = [-1.25, 0.0]
    offset[n_sensors + run.size.n_hidden :] = [1.1, 0.0]
    yield static(
        "/network/names",
        rr.Points2D(
            positions + offset,
            radii=0.001,
            labels=names,
            show_labels=True,
            colors=style.colours(style.LABEL),
            draw_order=20,
        ),
    )


def connections(weights: Weights, size: NetworkSize) -> Chunk:
    """A network's connections; the chunk may go into any number of recordings."""
    return _connections(np.ascontiguousarray(weights, np.int8).tobytes(), size)


@lru_cache(maxsize=64)
def _connections(weights: bytes, size: NetworkSize) -> Chunk:
    return static("/network/connections", drawing(np.frombuffer(weights, np.int8).reshape(size.n_neurons, -1), size))


def drawing(weights: Weights, size: NetworkSize) -> rr.LineStrips2D:
    """The strips of all connections that are there."""
    strips: list[Points] = []
    colours: list[int] = []
    curves = _curves(size)
    for neuron, source in zip(*np.nonzero(weights), strict=True):
        curve, head = curves[neuron][source]
        excitatory = weights[neuron, source] > 0
        parts = [curve] if excitatory else _dashes(curve)
        strips += [*parts, head]
        colours += [style.EXCITATORY if excitatory else style.INHIBITORY] * (len(parts) + 1)
    return rr.LineStrips2D(strips, colors=style.colours(*colours), radii=_LINE_RADIUS, draw_order=1)


def nodes(run: RecordedRun) -> rr.Points2D:
    """The nodes; their colours are logged beside this."""
    return rr.Points2D.from_fields(positions=layout(run.size), radii=_NODE_RADIUS, draw_order=10)


def resting(run: RecordedRun) -> NDArray[np.uint32]:
    """Colours of the nodes of a network that does nothing."""
    return style.activation_colours(np.zeros(run.size.n_sources))


def activations(run: RecordedRun, trial: RecordedTrial) -> Iterator[Chunk]:
    """The nodes light up with what they said at every step."""
    trace = trial.trace
    values = np.concatenate([sensors_to_q10(trace.sensors), trace.x], axis=1) / ONE
    columns = rr.Points2D.columns(colors=style.activation_colours(values).reshape(-1))
    yield static("/network/nodes", nodes(run))
    yield timed(
        "/network/nodes", step_times(trial.steps, run.tick_s), several(columns, trial.steps, run.size.n_sources)
    )


@lru_cache(maxsize=8)
def _curves(size: NetworkSize) -> list[list[tuple[Points, Points]]]:
    """The curve and the arrow head from every source to every neuron."""
    positions = layout(size)
    first_hidden, first_motor = size.n_sensors, size.n_sensors + size.n_hidden
    column = np.repeat([0, 1, 2], [size.n_sensors, size.n_hidden, size.n_motors])
    table = []
    for target in range(first_hidden, size.n_sources):
        row = []
        for source in range(size.n_sources):
            if source == target:
                row.append(_loop(positions[target], right=target >= first_motor))
                continue
            if column[source] == 0:
                bow = 0.0 if column[target] == 1 else 0.04
            else:
                bow = 0.10 if column[source] != column[target] else 0.24
            row.append(_arc(positions[source], positions[target], bow))
        table.append(row)
    return table


def _arc(start: Points, end: Points, bow: float) -> tuple[Points, Points]:
    """From rim to rim along a quadratic Bezier curve that bows to its left by a part of its length."""
    along = end - start
    control = (start + end) / 2 + bow * 2.0 * np.array([along[1], -along[0]])
    t = _CURVE[:, None]
    curve = (1 - t) ** 2 * start + 2 * t * (1 - t) * control + t**2 * end
    outside = np.linalg.norm(curve - start, axis=1) >= _NODE_RADIUS
    outside &= np.linalg.norm(curve - end, axis=1) >= _NODE_RADIUS + 0.05
    tip = _rim(control, end)
    body = np.concatenate([_rim(control, start)[None], curve[outside], tip[None]])
    return body, _head(tip, tip - body[-2])


def _rim(outside: Points, centre: Points) -> Points:
    away = outside - centre
    return np.asarray(centre + away / np.linalg.norm(away) * (_NODE_RADIUS + 0.05))


def _loop(centre: Points, *, right: bool) -> tuple[Points, Points]:
    """A circle that touches the node: above hidden neurons, above and right of motors."""
    radius = 0.40
    toward = np.array([0.55, -0.84]) if right else np.array([0.0, -1.0])
    middle = centre + toward * (_NODE_RADIUS + radius * 0.72)
    angle = np.arctan2(-toward[1], -toward[0]) + np.linspace(0.62, 2 * np.pi - 0.72, 18)
    curve = middle + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    return curve, _head(curve[-1], curve[-1] - curve[-3])


def _head(tip: Points, direction: Points) -> Points:
    forward = direction / np.linalg.norm(direction)
    side = np.array([forward[1], -forward[0]]) * _HEAD_HALF_WIDTH
    base = tip - forward * _HEAD_LENGTH
    return np.stack([base + side, tip, base - side])


def _dashes(curve: Points) -> list[Points]:
    """The same curve in short pieces."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    starts = np.arange(0.0, length[-1] - _DASH / 2, _DASH + _GAP)
    cuts = np.stack([starts, np.minimum(starts + _DASH, length[-1])], axis=1)
    points = np.stack([np.interp(cuts, length, curve[:, axis]) for axis in (0, 1)], axis=-1)
    return list(points)

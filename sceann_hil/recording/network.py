"""The controller as a drawing: sensors left, hidden neurons in the middle, motors right, every connection visible.

Sensors stand as the robot has them, its left on top, as the left motor does.
Solid blue is excitatory, dashed red is inhibitory, as in the paper's Figures 8 and 12. The network is recurrent and
fully interconnected, so connections inside a layer and backwards are arcs that bow to their left (a pair of opposite
connections never coincides) and self connections are loops. Arrow heads show the direction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import rerun as rr
from numpy.typing import NDArray
from rerun.chunk import Chunk

from sceann_hil.network.coding import NetworkSize, Weights
from sceann_hil.network.controller import ONE, sensors_to_q10
from sceann_hil.recording import style
from sceann_hil.recording.columns import several, static
from sceann_hil.recording.trial import RecordedRun, RecordedTrial

BOUNDS = ((-2.1, 9.9), (-5.6, 5.6))
"""What a view of the network should show: x range, y range (y points down)."""

_NODE_RADIUS = 0.32
_LINE_RADIUS = 0.028
_COLUMN_X = (0.0, 4.2, 8.0)
_CURVE = np.linspace(0.0, 1.0, 17)
_HEAD_LENGTH, _HEAD_HALF_WIDTH = 0.30, 0.13
_DASH, _GAP = 0.26, 0.20

Points = NDArray[np.float64]


Order = tuple[int, ...]
"""The sensors from top to bottom."""


def layout(size: NetworkSize, order: Order) -> Points:
    """Where the sources are drawn, in the order sensors, hidden, motors; shape ``(n_sources, 2)``."""
    columns = []
    for x, count, spacing in zip(
        _COLUMN_X, (size.n_sensors, size.n_hidden, size.n_motors), (1.45, 4.4, 5.0), strict=True
    ):
        spacing = min(spacing, 8.8 / max(count - 1, 1))
        y = (np.arange(count) - (count - 1) / 2) * spacing
        # a column of hidden neurons leans out, so that connections past a neighbour do not run through it
        lean = np.where(np.arange(count) % 2, 0.55, -0.55) if x == _COLUMN_X[1] and count > 2 else 0.0
        columns.append(np.column_stack([np.full(count, x) + lean, y]))
    columns[0][list(order)] = columns[0].copy()
    return np.concatenate(columns)


def network_scenery(run: RecordedRun) -> Iterator[Chunk]:
    """Names, nodes, and the lines of every connection there could be; a trial says which are seen."""
    size = run.size
    positions = layout(size, run.sensors_from_left)
    names = [*run.sensor_names, *run.hidden_names, *run.motor_names]
    offset = np.tile([0.0, 0.45], (len(positions), 1))
    offset[: size.n_sensors] = [-1.15, -0.37]
    offset[size.n_sensors + size.n_hidden :] = [1.05, -0.37]
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
    yield static("/network/nodes", rr.Points2D.from_fields(positions=positions, radii=_NODE_RADIUS, draw_order=10))
    yield static(
        "/network/connections",
        rr.LineStrips2D.from_fields(strips=_lines(size, run.sensors_from_left).strips, draw_order=1),
    )


def connections(weights: Weights, size: NetworkSize, order: Order) -> rr.LineStrips2D:
    """Which of the lines in `network_scenery` show this network.

    A line that is not there has no radius; where a viewer's graphics draw it as a hair all the same, it has the colour
    of the background.
    """
    lines = _lines(size, order)
    seen = weights.reshape(-1)[lines.connection] == lines.sign
    excitatory, inhibitory, nothing = style.colours(style.EXCITATORY, style.INHIBITORY, style.NOTHING)
    colours = np.where(seen, np.where(lines.sign > 0, excitatory, inhibitory), nothing)
    radii = np.where(seen, np.float32(_LINE_RADIUS), np.float32(np.nan))
    return rr.LineStrips2D.from_fields(colors=colours, radii=radii)


def activity(run: RecordedRun, trial: RecordedTrial) -> rr.ComponentColumnList:
    """Colours of the nodes, which light up with what they said at every step."""
    trace = trial.trace
    values = np.concatenate([sensors_to_q10(trace.sensors), trace.x], axis=1) / ONE
    columns = rr.Points2D.columns(colors=style.activation_colours(values).reshape(-1))
    return several(columns, trial.steps, run.size.n_sources)


@dataclass(frozen=True, slots=True)
class _Lines:
    """Lines of all possible connections: `connection` counts neuron by neuron, `sign` is what a line stands for."""

    strips: list[Points]
    connection: NDArray[np.intp]
    sign: NDArray[np.int8]


@lru_cache(maxsize=8)
def _lines(size: NetworkSize, order: Order) -> _Lines:
    strips: list[Points] = []
    connection: list[int] = []
    sign: list[int] = []
    for number, (curve, head) in enumerate(pair for row in _curves(size, order) for pair in row):
        for value, parts in ((1, [curve, head]), (-1, [*_dashes(curve), head])):
            strips += parts
            connection += [number] * len(parts)
            sign += [value] * len(parts)
    return _Lines(strips, np.array(connection), np.array(sign, np.int8))


def _curves(size: NetworkSize, order: Order) -> list[list[tuple[Points, Points]]]:
    """The curve and the arrow head from every source to every neuron."""
    positions = layout(size, order)
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

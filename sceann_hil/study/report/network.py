"""Fig. 8 and Fig. 12: a network; excitatory connections solid, inhibitory ones dashed, and the same as a matrix."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch

from sceann_hil.network.coding import NetworkSize, Weights
from sceann_hil.study.style import BLUE, DARK, GREY, LIGHT, RED, drawing, plain, save

_HEIGHT = 7.0
_RADIUS = 0.27
_Point = tuple[float, float]


def draw_network(
    weights: Weights, size: NetworkSize, sensors: Sequence[str], motors: Sequence[str], path: Path
) -> None:
    """A network in three columns, and its connection matrix beside it.

    Args:
        weights: -1, 0 or +1, shape ``(n_neurons, n_sources)``.
        size: of the network.
        sensors: a name for each sensor.
        motors: a name for each motor neuron.
        path: without suffix.
    """
    hidden = list(size.hidden_names)
    with drawing(17.0, 8.2) as figure:
        left, right = figure.subplots(1, 2, width_ratios=(1.45, 1.0))
        _draw_graph(left, weights, size, sensors, hidden, motors)
        _draw_matrix(right, weights, [*sensors, *hidden, *motors], [*hidden, *motors], size.n_sensors)
        solid = Line2D([], [], color=BLUE, label="excitatory (+1)")
        dashed = Line2D([], [], color=RED, linestyle=(0, (3.5, 2.0)), label="inhibitory (-1)")
        figure.legend(handles=[solid, dashed], loc="outside lower center", ncols=2)
        save(figure, path)


def _draw_graph(
    axes: Axes,
    weights: Weights,
    size: NetworkSize,
    sensors: Sequence[str],
    hidden: Sequence[str],
    motors: Sequence[str],
) -> None:
    plain(axes)
    height = _HEIGHT
    columns = (
        (0.0, _spread(size.n_sensors, height)),
        (0.58 * height, _spread(size.n_hidden, height)),
        (1.16 * height, _spread(size.n_motors, 0.8 * height)),
    )
    places: list[_Point] = [(x, y) for x, heights in columns for y in heights]
    nodes = [Circle(place, _RADIUS, facecolor="white", edgecolor=DARK, linewidth=1.1, zorder=3) for place in places]
    for node in nodes:
        axes.add_patch(node)
    for target in range(size.n_neurons):
        for source in range(size.n_sources):
            if weights[target, source]:
                to = size.n_sensors + target
                _connect(axes, nodes, source, to, int(weights[target, source]), size)
    for index, ((x, y), name) in enumerate(zip(places, [*sensors, *hidden, *motors], strict=True)):
        if index < size.n_sensors:
            axes.text(x - 1.5 * _RADIUS, y, name, ha="right", va="center", color=DARK)
        elif index < size.n_sensors + size.n_hidden:
            axes.text(x, y, name, ha="center", va="center", fontsize=7.2, color=DARK, zorder=4)
        else:
            axes.text(x + 1.6 * _RADIUS, y, name, ha="left", va="center", color=DARK)
    for (x, _), title in zip(columns, ("sensors", "hidden", "motors"), strict=True):
        axes.text(x, 0.56 * height, title, ha="center", va="bottom", color=GREY)
    axes.set_xlim(-0.16 * height, 1.38 * height)
    axes.set_ylim(-0.54 * height, 0.62 * height)
    axes.set_aspect("equal")


def _spread(n: int, height: float) -> list[float]:
    """`n` places from top to bottom, centred."""
    return [height * (0.5 - (k + 0.5) / n) for k in range(n)]


def _connect(axes: Axes, nodes: Sequence[Circle], source: int, target: int, weight: int, size: NetworkSize) -> None:
    style: Any = {
        "color": BLUE if weight > 0 else RED,
        "linestyle": "-" if weight > 0 else (0, (3.5, 2.0)),
        "linewidth": 1.1,
        "alpha": 0.9,
        "zorder": 2,
    }
    (x0, y0), (x1, y1) = nodes[source].center, nodes[target].center
    if source == target:
        axes.add_patch(Circle((x0, y0 + 1.65 * _RADIUS), 0.8 * _RADIUS, fill=False, **style))
        return
    # between two neurons there and back again on two sides; farther apart in one column, farther out
    bend = 0.16 if x0 != x1 else 0.25 + 0.16 * abs(y1 - y0) / _HEIGHT
    if source < size.n_sensors:
        bend = 0.0
    axes.add_patch(
        FancyArrowPatch(
            (x0, y0),
            (x1, y1),
            connectionstyle=f"arc3,rad={bend}",
            arrowstyle="-|>,head_length=0.55,head_width=0.28",
            mutation_scale=8.0,
            shrinkA=0.0,
            shrinkB=0.5,
            patchA=nodes[source],
            patchB=nodes[target],
            **style,
        )
    )


def _draw_matrix(axes: Axes, weights: Weights, sources: Sequence[str], targets: Sequence[str], n_sensors: int) -> None:
    axes.grid(False)
    for row, column in np.argwhere(weights != 0):
        positive = weights[row, column] > 0
        axes.text(
            column,
            row,
            "+" if positive else "-",
            ha="center",
            va="center",
            color=BLUE if positive else RED,
            fontweight="bold",
            fontsize=10,
        )
    for edge in np.arange(-0.5, len(sources)):
        axes.axvline(edge, color=GREY if edge == n_sensors - 0.5 else LIGHT, linewidth=0.8)
    for edge in np.arange(-0.5, len(targets)):
        axes.axhline(edge, color=LIGHT, linewidth=0.8)
    axes.set_xlim(-0.5, len(sources) - 0.5)
    axes.set_ylim(len(targets) - 0.5, -0.5)
    axes.set_xticks(range(len(sources)), sources, rotation=90 if len(sources) > 8 else 0)
    axes.set_yticks(range(len(targets)), targets)
    axes.tick_params(length=0)
    axes.spines[["left", "bottom"]].set_visible(False)
    axes.set_xlabel("from")
    axes.set_ylabel("to")
    axes.set_aspect("equal")

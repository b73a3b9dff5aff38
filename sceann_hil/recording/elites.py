"""The map of an algorithm like MAP-Elites in the run's overview: one picture for each generation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import rerun as rr
from rerun.chunk import Chunk

from sceann_hil.evolution.algorithm import Archive
from sceann_hil.recording import style
from sceann_hil.recording.columns import at_generation, once, static

ELITES = "/elites"
_SIDE = 10.0
"""Of the map, in the units of its view."""
BOUNDS = ((-2.2, 14.5), (-1.4, 11.8))
"""What a view of it should show: x range, y range (y points down)."""
_BAR_X, _BAR_WIDTH, _BAR_CELLS = 11.0, 0.7, 64


def map_scenery(archive: Archive) -> Iterator[Chunk]:
    """What holds for all generations: the frame, the axes' names and ends, the colour bar without its numbers."""
    side = _SIDE
    frame = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side], [0.0, 0.0]]
    yield static(
        f"{ELITES}/frame", rr.LineStrips2D([frame], colors=style.colours(style.WHEEL), radii=0.03, draw_order=5)
    )
    (left, right), names = archive.ranges[0], archive.names
    labels = [(0.0, side + 0.5, f"{left:g}"), (side, side + 0.5, f"{right:g}"), (side / 2, side + 1.1, names[0])]
    if len(names) > 1:
        low, high = archive.ranges[1]
        labels += [(-0.8, side, f"{low:g}"), (-0.8, 0.0, f"{high:g}"), (-1.0, side / 2, names[1])]
    labels.append((_BAR_X + _BAR_WIDTH / 2, -0.8, "fitness"))
    yield static(f"{ELITES}/labels", _labels(labels))
    ramp = style.map_image(np.linspace(1.0, 0.0, _BAR_CELLS)[:, None], 0.0, 1.0)
    scale = [_BAR_WIDTH, side / _BAR_CELLS, 1.0]
    yield static(f"{ELITES}/bar", rr.Transform3D(translation=[_BAR_X, 0.0, 0.0], scale=scale))
    yield static(f"{ELITES}/bar/image", rr.Image(ramp, draw_order=0))
    columns, rows = archive.plane.shape
    yield static(f"{ELITES}/map", rr.Transform3D(scale=[side / columns, side / rows, 1.0]))


def map_of(archive: Archive, generation: int) -> Iterator[Chunk]:
    """The map that a generation came from; nothing while it is empty."""
    if not len(archive.fitness):
        return
    low, high = float(archive.fitness.min()), float(archive.fitness.max())
    when = at_generation(generation)
    # the first row of a picture is its upper one
    picture = style.map_image(archive.plane.T[::-1], low, high)
    yield once(f"{ELITES}/map/image", when, rr.Image(picture, draw_order=0))
    x = _BAR_X + _BAR_WIDTH + 1.0
    n_cells = int(np.prod(archive.cells))
    filled = f"{len(archive.fitness)} of {n_cells} cells"
    texts = [(x, 0.0, f"{high:.4g}"), (x, _SIDE, f"{low:.4g}"), (_SIDE / 2, -0.5, filled)]
    yield once(f"{ELITES}/values", when, _labels(texts))


def _labels(labels: list[tuple[float, float, str]]) -> rr.Points2D:
    return rr.Points2D(
        [[x, y] for x, y, _ in labels],
        radii=0.001,
        labels=[text for *_, text in labels],
        show_labels=True,
        colors=style.colours(style.LABEL),
    )

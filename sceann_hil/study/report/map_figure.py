"""The map of an algorithm like MAP-Elites: what controllers do on its axes, how well they do it as colour."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sceann_hil.evolution.algorithm import Archive
from sceann_hil.study.style import drawing, save


def draw_map(archive: Archive, path: Path) -> None:
    """The first two axes; of further ones the best cell is shown. One axis alone is a row.

    Args:
        archive: with at least one filled cell.
        path: without suffix.
    """
    plane = archive.plane
    (left, right), names = archive.ranges[0], archive.names
    low, high = archive.ranges[1] if len(names) > 1 else (0.0, 1.0)
    with drawing(13.0, 11.0 if len(names) > 1 else 5.0) as figure:
        axes = figure.subplots()
        axes.grid(visible=False)
        shown = np.ma.masked_invalid(plane.T)
        image = axes.pcolormesh(
            np.linspace(left, right, plane.shape[0] + 1),
            np.linspace(low, high, plane.shape[1] + 1),
            shown,
            rasterized=True,
        )
        axes.set_xlabel(names[0])
        if len(names) > 1:
            axes.set_ylabel(names[1])
        else:
            axes.set_yticks([])
        figure.colorbar(image, ax=axes, label="fitness")
        save(figure, path)

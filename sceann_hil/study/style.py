"""One look for all figures, and one way to save them: as SVG and PNG, with the same bytes each time."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sceann_hil.versions import maker

BLUE, ORANGE, GREEN, RED, VIOLET = "#2166ac", "#e08214", "#1b7837", "#b2182b", "#762a83"
DARK, GREY, LIGHT = "#222222", "#8c8c8c", "#e6e6e6"
SERIES = ("#3b0f70", "#2166ac", "#1b9e77", "#e08214", "#b2182b")
"""Five ordered colours that differ in lightness too."""
MARKERS = ("o", "s", "^", "D", "v")

_RC: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": GREY,
    "axes.labelcolor": DARK,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": LIGHT,
    "grid.linewidth": 0.7,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": DARK,
    "ytick.labelcolor": DARK,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.6,
    "lines.markersize": 4.5,
    "svg.hashsalt": "sceann",
    "svg.fonttype": "path",
    "figure.facecolor": "white",
}


@contextmanager
def drawing(width_cm: float, height_cm: float) -> Iterator[Figure]:
    """A figure in the house style; everything drawn on it belongs inside the ``with`` block."""
    with matplotlib.rc_context(_RC):
        yield Figure(figsize=(width_cm / 2.54, height_cm / 2.54), layout="constrained")


def save(figure: Figure, path: Path) -> None:
    """Write ``path.svg`` and ``path.png``; equal figures give equal bytes."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with matplotlib.rc_context(_RC):
        figure.savefig(path.with_suffix(".svg"), metadata={"Date": None, "Creator": maker()})
        figure.savefig(path.with_suffix(".png"), dpi=160, metadata={"Software": maker()})


def plain(axes: Axes) -> None:
    """No axes at all: for drawings."""
    axes.set_axis_off()
    axes.grid(False)

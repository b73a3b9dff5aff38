"""Figures show what they are given, and are the same bytes each time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.patches import Circle, FancyArrowPatch

from sceann_hil.network.coding import NetworkSize
from sceann_hil.study.report import network
from sceann_hil.study.report.behaviour import straightness
from sceann_hil.study.report.more_figures import ForestRow, draw_forest
from sceann_hil.study.statistics import Interval
from sceann_hil.study.style import drawing


def test_every_connection_is_one_line_and_inhibition_is_dashed() -> None:
    size = NetworkSize(3, 2, 2)
    weights = np.random.default_rng(1).integers(-1, 2, (size.n_neurons, size.n_sources)).astype(np.int8)
    with drawing(10.0, 10.0) as figure:
        axes = figure.subplots()
        network._draw_graph(axes, weights, size, ["a", "b", "c"], ["h1", "h2"], ["l", "r"])
    loops = [patch for patch in axes.patches if isinstance(patch, Circle) and not patch.get_fill()]
    arrows = [patch for patch in axes.patches if isinstance(patch, FancyArrowPatch)]
    own = np.diag(weights[:, size.n_sensors :])
    assert len(loops) == np.count_nonzero(own)
    assert len(arrows) + len(loops) == np.count_nonzero(weights)
    solid = [patch for patch in (*arrows, *loops) if patch.get_linestyle() in ("-", "solid")]
    assert len(solid) == np.count_nonzero(weights > 0)


def test_the_same_figure_has_the_same_bytes(tmp_path: Path) -> None:
    default = Interval(30.0, 28.0, 32.0)
    rows = [ForestRow("a", default, default, False), ForestRow("b", Interval(20.0, 18.0, 22.0), default, True)]
    for name in ("one", "two"):
        draw_forest(rows, "success (%)", tmp_path / name)
    for suffix in (".svg", ".png"):
        assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()


def test_a_straight_path_after_a_turn_has_ratio_one() -> None:
    turn = [(0.0, 0.0, angle) for angle in np.linspace(np.pi, 0.0, 10)]
    straight = [(x, 0.0, 0.0) for x in np.linspace(0.0, 0.5, 30)]
    assert straightness(np.array([*turn, *straight], np.float32), 0.016) == pytest.approx(1.0, abs=1e-5)
    bow = [(np.sin(a), 1.0 - np.cos(a), a) for a in np.linspace(0.0, np.pi / 2.0, 100)]
    # the heading is within 20 degrees of the chord from 25 degrees on
    rest = np.deg2rad(65.0) / (2.0 * np.sin(np.deg2rad(32.5)))
    assert straightness(np.array(bow, np.float32), 0.016) == pytest.approx(rest, rel=0.01)

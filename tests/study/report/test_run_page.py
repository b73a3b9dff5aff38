"""The report of one run, and the map of MAP-Elites in it and in the run's overview."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import sceann_hil as sh
from sceann_hil.errors import NotARun
from sceann_hil.evolution.algorithm import Archive
from sceann_hil.recording import elites, overview, style
from sceann_hil.recording.source import RunSource
from sceann_hil.study.report import write_report
from tests.runs import GOAL, evolve

AXES = "[{measure: x_m, range: [0, 0.6], cells: 6}, {measure: y_m, range: [0, 0.6], cells: 4}]"
MAP = f"algorithm={{type: map_elites, population: 6, generations: 2, axes: {AXES}}}"


def _archive(cells: tuple[int, ...], places: list[list[int]], fitness: list[float]) -> Archive:
    names, ranges = tuple(f"m{k}" for k in range(len(cells))), ((0.0, 1.0),) * len(cells)
    n = len(places)
    return Archive(
        names,
        ranges,
        cells,
        np.array(places).reshape(n, len(cells)),
        np.zeros((n, 3), np.uint8),
        np.array(fitness),
        np.zeros((n, len(cells))),
    )


def test_a_plane_shows_the_best_of_all_further_axes() -> None:
    plane = _archive((2, 3, 2), [[0, 1, 0], [0, 1, 1], [1, 2, 0]], [1.0, 4.0, -2.0]).plane
    assert plane.shape == (2, 3)
    assert plane[0, 1] == 4.0
    assert plane[1, 2] == -2.0
    assert np.isnan(plane).sum() == 4
    assert _archive((3,), [[2]], [5.0]).plane.tolist()[2] == [5.0]


def test_a_picture_of_a_map_has_a_colour_for_every_fitness_and_none_where_it_is_empty() -> None:
    image = style.map_image(np.array([[np.nan, 0.0], [1.0, 2.0]]), 0.0, 2.0)
    assert len({tuple(pixel) for row in image.tolist() for pixel in row}) == 4
    assert image[1, 1].tolist() == [253, 231, 37]


def test_a_run_with_a_map_is_reported_and_recorded_with_it(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL, MAP)
    markdown, page = write_report(tmp_path / "run", tmp_path / "out")
    text = markdown.read_text(encoding="utf-8")
    archive = sh.open(tmp_path / "run").archive()
    assert f"{len(archive)} of 24 cells are filled" in text
    assert f"`sceann report {tmp_path / 'run'}`" in text
    assert archive["genome"].iloc[int(archive["fitness"].argmax())] in text
    assert page.read_text(encoding="utf-8").count("data:image/svg+xml") == 2
    svg = (tmp_path / "out" / "report" / "map.svg").read_text(encoding="utf-8")
    assert "x_m" in svg
    assert "fitness" in svg
    source = RunSource(tmp_path / "run")
    start = overview.overview_start(source.run, source.config, source.seed, source.empty_archive)
    assert f"{elites.ELITES}/labels" in {chunk.entity_path for chunk in start}
    shown = [chunk.entity_path for chunk in overview.overview_generation(source.run, source.generation(2))]
    first = [chunk.entity_path for chunk in overview.overview_generation(source.run, source.generation(0))]
    source.close()
    assert f"{elites.ELITES}/map/image" in shown
    assert f"{elites.ELITES}/map/image" not in first


def test_a_run_without_a_map_has_a_report_too(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL, "algorithm.generations=1")
    markdown, _ = write_report(tmp_path / "run", tmp_path / "out")
    assert "Different controllers" not in markdown.read_text(encoding="utf-8")
    with pytest.raises(NotARun, match="neither a study with results nor a landscape nor a run"):
        write_report(tmp_path, tmp_path / "out")

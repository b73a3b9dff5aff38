"""MAP-Elites: an archive over what controllers do, in a run, in a study, and after a crash."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sceann_hil as sh
from sceann_hil.config import ExperimentConfig, journalled_config
from sceann_hil.errors import ConfigError, NotARun, PackageMissing
from sceann_hil.evolution import MapElites, MapElitesState
from sceann_hil.journal import JournalReader
from sceann_hil.run.experiment import Experiment
from sceann_hil.study.blocks import evolve_together
from tests.runs import GOAL, config_of, contents, evolve, resume

AXES = "[{measure: x_m, range: [0, 0.6], cells: 6}, {measure: y_m, range: [0, 0.6], cells: 6}]"
MAP = f"algorithm={{type: map_elites, population: 8, generations: 5, axes: {AXES}}}"


def _archive(directory: Path) -> tuple[MapElites, MapElitesState]:
    reader = JournalReader(directory)
    config = journalled_config(reader)
    algorithm: Any = config.algorithm.build(config.genome_length)
    return algorithm, algorithm.load(reader.algorithm_state(config.algorithm.generations))


def test_the_archive_keeps_the_best_of_each_cell() -> None:
    config = config_of(GOAL, MAP)
    algorithm: Any = config.algorithm.build(config.genome_length)
    rng = np.random.default_rng(0)
    state = algorithm.start(rng)
    measures = np.array([[0.05, 0.05]] * 4 + [[0.55, 0.05]] * 2 + [[9.0, 9.0], [-9.0, -9.0]])
    fitness = np.array([1.0, 4.0, 2.0, 3.0, -1.0, -2.0, 0.5, 5.0])
    told = algorithm.tell_with_measures(state, fitness, measures, rng)
    assert told.cells.tolist() == [0, 30, 35]
    assert told.reached.tolist() == [5.0, -1.0, 0.5]
    assert np.array_equal(told.elites, state.genomes[[7, 4, 6]])
    worse = algorithm.tell_with_measures(told, np.full(8, -5.0), measures, rng)
    assert np.array_equal(worse.elites, told.elites)
    assert (worse.parents == -1).all()


def test_a_child_knows_its_parent_and_its_parents_cell() -> None:
    config = config_of(GOAL, MAP)
    algorithm: Any = config.algorithm.build(config.genome_length)
    rng = np.random.default_rng(0)
    state = algorithm.start(rng)
    told = algorithm.tell_with_measures(state, np.arange(8.0), np.linspace(0, 0.6, 16).reshape(8, 2), rng)
    for child, parent, cell in zip(told.genomes, told.parents, told.parent_cells, strict=True):
        elite = told.elites[told.cells.tolist().index(cell)]
        assert np.array_equal(elite, state.genomes[parent])
        assert (child != elite).mean() < 0.5


def test_a_run_is_the_same_after_a_stop_at_any_generation(tmp_path: Path) -> None:
    evolve(tmp_path / "whole", GOAL, MAP)
    config = config_of(GOAL, MAP)
    for stopped in range(5):
        directory = tmp_path / f"stopped{stopped}"

        def stop_here(progress: Any, stopped: int = stopped) -> None:
            if progress.generation.number == stopped:
                raise KeyboardInterrupt

        with (
            Experiment.create(config, directory) as experiment,
            config.robot.build() as robot,
            pytest.raises(KeyboardInterrupt),
        ):
            experiment.evolve(robot, stop_here)
        resume(directory)
        assert contents(directory) == contents(tmp_path / "whole")


def test_measures_in_a_run_and_in_a_study_are_the_same(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL, MAP)
    config: ExperimentConfig = config_of(GOAL, MAP)
    with config.robot.build() as robot:
        last = list(evolve_together(config, np.array([config.seed], np.uint64), robot))[-1]
    algorithm, state = _archive(tmp_path / "run")
    assert algorithm.dump(state) == algorithm.dump(last.states[0])  # type: ignore[arg-type]
    assert len(state.elites) > 3


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            (MAP.replace("x_m", "mood"),),
            "wants the measure mood; task goal_reach on robot diffdrive offers x_m, y_m, head",
        ),
        ((MAP, "saving.racing=exact"), "saving: expected that every trial is run"),
        ((MAP.replace("[0, 0.6]", "[0.6, 0]"),), r"range: expected \[lowest, highest\], got \[0.6, 0.0\]"),
        ((MAP.replace("cells: 6", "cells: 400"),), "axes: expected at most 100000 cells in all, got 160000"),
        ((MAP.replace("y_m", "x_m"),), "axes: expected a different measure on each, got x_m, x_m"),
    ],
)
def test_a_map_that_cannot_be_is_refused(settings: tuple[str, ...], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        config_of(GOAL, *settings)


def test_without_ribs_the_message_names_the_extra(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "ribs", None)
    with pytest.raises(PackageMissing, match="ribs"):
        evolve(tmp_path / "run", GOAL, MAP)


def test_the_map_of_a_run_is_a_table(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL, MAP)
    run = sh.open(tmp_path / "run")
    archive = run.archive()
    assert list(archive.columns) == ["cell_x_m", "cell_y_m", "x_m", "y_m", "fitness", "genome"]
    algorithm, state = _archive(tmp_path / "run")
    assert len(archive) == len(state.elites)
    assert ((archive.x_m / 0.1).clip(0, 5.999).astype(int) == archive.cell_x_m).all()
    grid = algorithm.archive(state).grid
    assert np.isfinite(grid).sum() == len(archive)
    assert grid[archive.cell_x_m[0], archive.cell_y_m[0]] == archive.fitness[0]
    best = archive.loc[archive.fitness.idxmax()]
    trials = run.simulate(sh.Individual.from_hex(run.config.phenotype, best.genome))
    assert len(trials) == 3


def test_a_run_without_a_map_says_so(tmp_path: Path) -> None:
    evolve(tmp_path / "run", GOAL)
    with pytest.raises(NotARun, match="the algorithm oga keeps no archive"):
        sh.open(tmp_path / "run").archive()

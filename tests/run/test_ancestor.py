"""Going on elsewhere: populations that change the robot, and parents that are linked across two journals."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.errors import ConfigError, NotARun
from sceann_hil.journal import JOURNAL_NAME, JournalReader
from sceann_hil.run.ancestor import Ancestor, Take
from sceann_hil.run.experiment import Experiment
from tests.runs import GOAL, POLE, config_of, evolve


def go_on(directory: Path, source: Path, text: str, take: Take, *overrides: str) -> JournalReader:
    config = config_of(text, *overrides)
    with Experiment.create(config, directory, Ancestor(source, take)) as experiment, config.robot.build() as robot:
        experiment.evolve(robot)
    return JournalReader(directory)


@pytest.fixture(scope="module", params=[POLE, GOAL], ids=["sga", "oga"])
def source(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    directory = tmp_path_factory.mktemp("source") / "run"
    evolve(directory, request.param)
    return directory, request.param


def test_the_whole_population_goes_on_unchanged(source: tuple[Path, str], tmp_path: Path) -> None:
    directory, text = source
    gap = "robot.gap.sensor_offset=0.01"
    reader, parents = go_on(tmp_path / "on", directory, text, Take.POPULATION, gap), JournalReader(directory)
    last = parents.individuals(config_of(text).algorithm.generations)
    first = reader.individuals(0)
    assert [row.genome for row in first] == [row.genome for row in last]
    assert [row.structure for row in first] == [row.structure for row in last]
    assert [row.ancestor for row in first] == [row.id for row in last]
    assert reader.run().parent_run == str(directory)
    assert all(row.fitness is not None for row in first)


def test_the_best_goes_on_with_children_of_it(source: tuple[Path, str], tmp_path: Path) -> None:
    directory, text = source
    reader, parents = go_on(tmp_path / "on", directory, text, Take.BEST), JournalReader(directory)
    champion = parents.champion()
    assert champion is not None
    first = reader.individuals(0)
    assert {row.ancestor for row in first} == {champion.id}
    assert first[0].genome == champion.genome
    length = config_of(text).genome_length
    distances = [int((row.genome_bits(length) != champion.genome_bits(length)).sum()) for row in first]
    assert 0 < np.mean(distances) < length / 4


def test_another_algorithm_and_another_size_take_the_expressed_bits(source: tuple[Path, str], tmp_path: Path) -> None:
    directory, text = source
    other = "algorithm.type=" + ("oga" if text == POLE else "sga")
    reader = go_on(tmp_path / "on", directory, text, Take.POPULATION, other, "algorithm.population=11")
    last = JournalReader(directory).individuals(config_of(text).algorithm.generations)
    first = reader.individuals(0)
    assert [row.genome for row in first] == [last[i % len(last)].genome for i in range(11)]
    assert [row.ancestor for row in first] == [last[i % len(last)].id for i in range(11)]


def test_a_resumed_run_keeps_its_first_generation(source: tuple[Path, str], tmp_path: Path) -> None:
    directory, text = source
    config = config_of(text)
    Experiment.create(config, tmp_path / "on", Ancestor(directory)).close()
    with Experiment.open(tmp_path / "on") as experiment, config.robot.build() as robot:
        experiment.evolve(robot)
    first = JournalReader(tmp_path / "on").individuals(0)
    last = JournalReader(directory).individuals(config.algorithm.generations)
    assert [row.genome for row in first] == [row.genome for row in last]


@pytest.mark.parametrize(
    "override", ["controller.n_hidden=4", "controller.neuron=memoryless", "controller.coding=sceann1"]
)
def test_genomes_that_mean_something_else_are_refused(source: tuple[Path, str], override: str, tmp_path: Path) -> None:
    directory, text = source
    with pytest.raises(ConfigError, match="as in"):
        Experiment.create(config_of(text, override), tmp_path / "on", Ancestor(directory))
    assert not (tmp_path / "on").exists()


def test_a_run_without_a_finished_generation_is_refused(tmp_path: Path) -> None:
    Experiment.create(config_of(POLE), tmp_path / "begun").close()
    with pytest.raises(NotARun, match="no finished generation"):
        Experiment.create(config_of(POLE), tmp_path / "on", Ancestor(tmp_path / "begun"))


def test_the_journal_is_whole_or_absent(source: tuple[Path, str], tmp_path: Path) -> None:
    """The first generation is in the file before the file has its name."""
    directory, text = source
    Experiment.create(config_of(text), tmp_path / "on", Ancestor(directory)).close()
    db = sqlite3.connect(tmp_path / "on" / JOURNAL_NAME)
    assert db.execute("SELECT count(*) FROM generation").fetchone() == (1,)

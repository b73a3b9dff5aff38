"""More than one number for each individual: a wrapped library that keeps the best compromises of two objectives."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from sceann_hil.evolution import AskTellAlgorithm
from sceann_hil.evolution.ask_tell import Optimiser
from sceann_hil.journal import JournalReader
from sceann_hil.network.coding import Bits
from sceann_hil.plugins import AlgorithmConfig
from sceann_hil.run.experiment import Experiment
from tests.installed import installed
from tests.runs import GOAL, config_of, contents, resume


class Compromises:
    """A library: children of genomes that nobody beats in both objectives."""

    def __init__(self, front: list[list[int]], values: list[list[float]], n: int, rng: np.random.Generator) -> None:
        self.front, self.values, self.n, self.rng = front, values, n, rng

    def ask(self) -> NDArray[np.uint8]:
        parents = np.array(self.front, np.uint8)[self.rng.integers(len(self.front), size=self.n)]
        return parents ^ (self.rng.random(parents.shape) < 0.1).astype(np.uint8)

    def tell(self, genomes: Bits, fitness: NDArray[np.float64]) -> None:
        raise AssertionError("it wants both objectives")

    def tell_with_measures(self, genomes: Bits, fitness: NDArray[np.float64], measures: NDArray[np.float64]) -> None:
        known = [*zip(self.front, self.values, strict=True), *zip(genomes.tolist(), measures.tolist(), strict=True)]
        kept = [(g, v) for g, v in known if not any(w[0] >= v[0] and w[1] >= v[1] and w != v for _, w in known)]
        self.front, self.values = [g for g, _ in kept], [v for _, v in kept]


class Wrapped(AskTellAlgorithm):
    def make(self, rng: np.random.Generator) -> Optimiser:
        return Compromises(
            rng.integers(0, 2, (4, self.genome_length)).tolist(), [[-1.0, -1.0]] * 4, self.population, rng
        )

    def save(self, optimiser: Optimiser) -> bytes:
        assert isinstance(optimiser, Compromises)
        return json.dumps([optimiser.front, optimiser.values]).encode()

    def restore(self, data: bytes, rng: np.random.Generator) -> Optimiser:
        front, values = json.loads(data)
        return Compromises(front, values, self.population, rng)


class CompromisesConfig(AlgorithmConfig):
    """Two objectives: end far to the right, and far up."""

    type: Literal["compromises"] = "compromises"
    population: int = 6
    generations: int = 4

    @property
    def measures(self) -> tuple[str, ...]:
        return ("x_m", "y_m")

    def build(self, genome_length: int) -> Wrapped:
        return Wrapped(genome_length, self.population, "COMP")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    entry = {"compromises": f"[sceann_hil.algorithms]\ncompromises = {__name__}:CompromisesConfig\n"}
    with installed(tmp_path / "site", entry, monkeypatch):
        yield


@pytest.mark.usefixtures("package")
def test_a_wrapped_library_is_told_both_objectives_and_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    config = config_of(GOAL, "algorithm={type: compromises}")
    with Experiment.create(config, tmp_path / "whole") as experiment, config.robot.build() as robot:
        experiment.evolve(robot)

    def stop_here(progress: Any) -> None:
        if progress.generation.number == 2:
            raise RuntimeError("stopped")

    with (
        Experiment.create(config, tmp_path / "stopped") as experiment,
        config.robot.build() as robot,
        pytest.raises(RuntimeError),
    ):
        experiment.evolve(robot, stop_here)
    resume(tmp_path / "stopped")
    assert contents(tmp_path / "whole") == contents(tmp_path / "stopped")
    reader = JournalReader(tmp_path / "whole")
    front, values = json.loads(Wrapped(config.genome_length, 6, "COMP").load(reader.algorithm_state(4)).optimiser)
    reader.close()
    assert len(front) == len(values)
    assert max(x for x, _ in values) > 0.0

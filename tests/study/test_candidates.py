"""Champions of a study as candidates of a transfer: known by what the folder holds, refused where they do not fit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from small_study import SMALL

from sceann_hil.errors import ConfigError, NotARun
from sceann_hil.network.coding import genome_to_hex
from sceann_hil.run.transfer.sources import kind_of, read_source
from sceann_hil.study import Block, BlockResult, StudyReader, compute_block, parse_study, run_study
from tests.runs import POLE, config_of


class Here:
    """Computes in this process."""

    count = 1
    description = "the test"

    def compute(self, blocks: Iterable[Block]) -> Iterator[BlockResult]:
        yield from map(compute_block, blocks)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study")
    run_study(parse_study(SMALL, "s", ["runs=3", "base.algorithm.generations=1"]), folder, Here())
    return folder


def test_the_champions_of_fitting_conditions_come_fittest_first(folder: Path) -> None:
    config = config_of(POLE, "controller.n_hidden=2", "robot.n_sensors=4")
    found = [genome_to_hex(bits) for bits in read_source(folder, config)]
    with StudyReader(folder) as study:
        fitting = [c.number for c in study.conditions() if c.config.size.n_sensors == 4]
        best: dict[str, float] = {}
        for number in fitting:
            runs = study.runs(number)
            for genome, fitness in zip(runs.genomes, runs.fitness.tolist(), strict=True):
                best[genome] = max(fitness, best.get(genome, 0.0))
    assert len(fitting) == 2
    assert set(found) == set(best)
    assert [best[genome] for genome in found] == sorted(best.values(), reverse=True)


def test_a_study_of_other_networks_is_refused(folder: Path) -> None:
    with pytest.raises(ConfigError, match="no condition of this study has the controller"):
        read_source(folder, config_of(POLE, "controller.n_hidden=5"))


def test_a_folder_that_nobody_knows_is_no_run(tmp_path: Path) -> None:
    assert kind_of(tmp_path) is None
    with pytest.raises(NotARun):
        read_source(tmp_path, config_of(POLE))

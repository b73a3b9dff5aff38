"""One champion for everybody who asks: kept by the algorithm, or the best that the run ever had."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

import sceann_hil
from sceann_hil.cli import app
from sceann_hil.config import dump_config
from sceann_hil.journal import JournalReader
from sceann_hil.network.coding import genome_to_hex
from sceann_hil.study.blocks import Block, compute_block
from tests.runs import POLE, config_of, evolve

LOST = ("algorithm.elites=0", "algorithm.mutation_rate=0.5", "algorithm.generations=6", "algorithm.tournament=1")


def asked(run: Path) -> dict[str, str]:
    """The champion's genome by whom one asks."""
    told = {}
    for command in ("status", "champion"):
        result = CliRunner().invoke(app, [command, str(run), "--json"], catch_exceptions=False)
        document = json.loads(result.stdout)
        told[command] = (document["champion"] if command == "status" else document["champions"][0])["genome"]
    told["python"] = genome_to_hex(sceann_hil.open(run).champion().genome)
    return told


@pytest.mark.parametrize("keeps", [True, False])
def test_everybody_means_the_same_individual(keeps: bool, tmp_path: Path) -> None:
    """Regression: without elites `status` told of one individual and of a best fitness that another one had."""
    overrides = () if keeps else LOST
    evolve(tmp_path / "run", POLE, *overrides)
    reader = JournalReader(tmp_path / "run")
    every = [row for g in reader.generations() for row in reader.individuals(g.number)]
    last = reader.generations()[-1].number
    best = max((row for row in every if row.generation == last or not keeps), key=lambda row: (row.fitness, -row.id))
    assert set(asked(tmp_path / "run").values()) == {best.genome}
    config = config_of(POLE, *overrides)
    study = compute_block(Block(0, 0, dump_config(config), (config.seed,)))
    assert study.genomes == (best.genome,)
    assert study.fitness.tolist() == [best.fitness]
    if not keeps:
        assert best.generation < last

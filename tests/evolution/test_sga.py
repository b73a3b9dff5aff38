"""The simple genetic algorithm as a whole."""

from __future__ import annotations

import hashlib

import numpy as np
from scipy import stats

from sceann_hil.evolution import SGA, SGAConfig

LEAST_P = 1e-4


def test_the_defaults_are_the_papers() -> None:
    config = SGAConfig()
    assert (config.population, config.generations, config.tournament, config.elites) == (25, 50, 2, 1)
    assert config.build(24).mutation_rate == 1 / 24


def test_children_are_winners_of_tournaments() -> None:
    algorithm = SGA(8, SGAConfig(population=10))
    rng = np.random.default_rng(1)
    state = algorithm.start(rng)
    parents = np.concatenate([algorithm.tell(state, np.arange(10.0), rng).parents[1:] for _ in range(1_000)])
    rank = np.arange(10.0)
    probability = ((rank + 1) ** 2 - rank**2) / 100
    assert stats.chisquare(np.bincount(parents, minlength=10), probability * parents.size).pvalue > LEAST_P


def test_it_solves_onemax() -> None:
    algorithm = SGA(20, SGAConfig(mutation_rate=1 / 20))
    rng = np.random.default_rng(2)
    state = algorithm.start(rng)
    for _ in range(200):
        state = algorithm.tell(state, state.genomes.sum(axis=1), rng)
    assert state.genomes.sum(axis=1).max() == 20


def test_a_seeded_run_is_the_one_we_know() -> None:
    algorithm = SGA(24)
    rng = np.random.default_rng(20_240_607)
    state = algorithm.start(rng)
    weights = np.arange(1.0, 25.0) % 7 - 2
    for _ in range(20):
        state = algorithm.tell(state, state.genomes @ weights, rng)
    assert (
        hashlib.sha256(algorithm.dump(state)).hexdigest()
        == "298b691307ceffcdf25c5e498a347a1a15a442fba82bdb71d6aa2cde2d41fddb"
    )

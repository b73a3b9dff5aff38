"""What every algorithm promises, whatever its settings."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from sceann_hil.evolution import (
    OGA,
    SGA,
    Algorithm,
    GenerationalConfig,
    OGAConfig,
    SGAConfig,
    State,
)


@pytest.fixture(scope="module")
def algorithm(config: GenerationalConfig, genome_length: int) -> Algorithm[Any]:
    return config.build(genome_length)


def _run(algorithm: Algorithm[Any], generations: int, seed: int = 1) -> State:
    rng = np.random.default_rng(seed)
    state: State = algorithm.start(rng)
    for _ in range(generations):
        state = algorithm.tell(state, algorithm.ask(state).sum(axis=1), rng)
    return state


def test_the_first_generation_is_random_and_has_no_parents(algorithm: Algorithm[Any], genome_length: int) -> None:
    state = _run(algorithm, 0)
    assert state.genomes.shape == (25, genome_length)
    assert state.genomes.dtype == np.uint8
    assert set(state.genomes.ravel().tolist()) == {0, 1}
    assert 0.4 < state.genomes.mean() < 0.6
    assert (state.parents == -1).all()
    assert state.parents.dtype == np.int32


def test_generations_keep_their_shape_and_name_their_parents(algorithm: Algorithm[Any], genome_length: int) -> None:
    state = _run(algorithm, 5)
    assert state.genomes.shape == (25, genome_length)
    assert state.genomes.dtype == np.uint8
    assert state.genomes.max() <= 1
    assert state.parents.shape == (25,)
    assert state.parents.dtype == np.int32
    assert state.parents.min() >= 0
    assert state.parents.max() < 25


def test_exactly_one_elite_comes_first_and_unmutated(config: GenerationalConfig, genome_length: int) -> None:
    algorithm = config.model_copy(update={"mutation_rate": 1.0}).build(genome_length)
    state = _run(algorithm, 3)
    for elite in (0, 7, 24):
        fitness = np.zeros(25)
        fitness[elite] = 1.0
        children = algorithm.tell(state, fitness, np.random.default_rng(elite))
        assert children.parents[0] == elite
        assert np.array_equal(children.genomes[0], state.genomes[elite])


def test_several_elites_or_none(config: GenerationalConfig, genome_length: int) -> None:
    fitness = np.arange(25.0)
    for elites in (0, 3, 24):
        algorithm = config.model_copy(update={"mutation_rate": 1.0, "elites": elites}).build(genome_length)
        state = _run(algorithm, 0)
        children = algorithm.tell(state, fitness, np.random.default_rng(2))
        assert children.parents[:elites].tolist() == list(range(24, 24 - elites, -1))
        assert np.array_equal(children.genomes[:elites], state.genomes[children.parents[:elites]])


def test_the_best_fitness_never_falls(algorithm: Algorithm[Any]) -> None:
    rng = np.random.default_rng(3)
    state = algorithm.start(rng)
    best = []
    for _ in range(30):
        fitness = state.genomes.sum(axis=1)
        best.append(int(fitness.max()))
        state = algorithm.tell(state, fitness, rng)
    assert best == sorted(best)
    assert best[-1] > best[0]


def test_the_same_seed_gives_the_same_run_and_another_seed_another(algorithm: Algorithm[Any]) -> None:
    assert algorithm.dump(_run(algorithm, 4)) == algorithm.dump(_run(algorithm, 4))
    assert algorithm.dump(_run(algorithm, 4)) != algorithm.dump(_run(algorithm, 4, seed=2))


def test_a_state_is_read_only_and_telling_leaves_it_alone(algorithm: Algorithm[Any]) -> None:
    for state in (_run(algorithm, 0), _run(algorithm, 2), algorithm.load(algorithm.dump(_run(algorithm, 2)))):
        before = algorithm.dump(state)
        algorithm.tell(state, np.zeros(25), np.random.default_rng(0))
        assert algorithm.dump(state) == before
        for name in ("genomes", "parents", "values", "lengths", "operons"):
            assert not hasattr(state, name) or not getattr(state, name).flags.writeable


def test_a_loaded_state_goes_on_as_the_dumped_one(algorithm: Algorithm[Any]) -> None:
    for generations in (0, 6):
        state = _run(algorithm, generations)
        data = algorithm.dump(state)
        loaded = algorithm.load(data)
        assert algorithm.dump(loaded) == data
        fitness = np.arange(25.0)
        continued = [algorithm.tell(s, fitness, np.random.default_rng(9)) for s in (state, loaded)]
        assert algorithm.dump(continued[0]) == algorithm.dump(continued[1])
        assert np.array_equal(continued[0].genomes, continued[1].genomes)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_fitness_that_is_not_a_number_is_refused(algorithm: Algorithm[Any], bad: float) -> None:
    fitness = np.zeros(25)
    fitness[11] = bad
    with pytest.raises(ValueError, match=f"fitness: expected a finite number.*got {bad} for individual 11"):
        algorithm.tell(_run(algorithm, 0), fitness, np.random.default_rng(0))


@pytest.mark.parametrize("shape", [(24,), (26,), (0,), (25, 1), ()])
def test_a_fitness_of_another_shape_is_refused(algorithm: Algorithm[Any], shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match=r"fitness: expected shape \(25,\)"):
        algorithm.tell(_run(algorithm, 0), np.zeros(shape), np.random.default_rng(0))


def test_a_state_of_another_size_is_refused(config: GenerationalConfig, algorithm: Algorithm[Any]) -> None:
    for population, genome_length in ((24, 24), (25, 12)):
        other = config.model_copy(update={"population": population}).build(genome_length)
        state = other.start(np.random.default_rng(0))
        with pytest.raises(ValueError, match=r"state: expected genomes of shape \(25, 24\)"):
            algorithm.tell(state, np.zeros(25), np.random.default_rng(0))
        with pytest.raises(ValueError, match=r"state: expected genomes of shape \(25, 24\)"):
            algorithm.dump(state)
        with pytest.raises(ValueError, match="state: expected a dump with"):
            algorithm.load(other.dump(state))


def test_damaged_dumps_are_refused(algorithm: Algorithm[Any]) -> None:
    data = algorithm.dump(_run(algorithm, 2))
    for size in (*range(0, 40), len(data) // 2, len(data) - 1):
        with pytest.raises(ValueError, match="state: expected"):
            algorithm.load(data[:size])
    with pytest.raises(ValueError, match="state: expected"):
        algorithm.load(data + b"\0")
    another_version = data[:4] + b"\xff" + data[5:]
    with pytest.raises(ValueError, match="version=255"):
        algorithm.load(another_version)
    no_such_parent = data[:-4] + (25).to_bytes(4, "little")
    with pytest.raises(ValueError, match="state: expected parents from -1 to 24"):
        algorithm.load(no_such_parent)


def test_an_algorithm_refuses_the_dump_of_another() -> None:
    rng = np.random.default_rng(0)
    sga, oga, short = SGA(24), OGA(24), OGA(24, OGAConfig(cap=5))
    with pytest.raises(ValueError, match=r"name='OGA'.*name='SGA'"):
        oga.load(sga.dump(sga.start(rng)))
    with pytest.raises(ValueError, match=r"cap=6.*cap=5"):
        oga.load(short.dump(short.start(rng)))
    with pytest.raises(ValueError, match="state: expected 6 values per locus"):
        oga.tell(short.start(rng), np.zeros(25), rng)


def test_impossible_lists_and_operons_are_refused() -> None:
    algorithm = OGA(8, OGAConfig(population=2))
    data = algorithm.dump(algorithm.start(np.random.default_rng(0)))
    header, values, lengths = 16, 2 * 8 * 6 // 8, 2 * 8
    for place, byte, message in (
        (header, 0b01000000, "expected 0 behind the end"),
        (header + values, 0, "expected lists of 1 to 6 values"),
        (header + values, 7, "expected lists of 1 to 6 values"),
        (header + values + lengths, 1, "expected operons numbered by first appearance"),
        (header + values + lengths + 1, 0x80, "expected operons numbered by first appearance"),
    ):
        damaged = bytearray(data)
        damaged[place] = byte
        with pytest.raises(ValueError, match=message):
            algorithm.load(bytes(damaged))


@pytest.mark.parametrize("length", [0, 32768])
@pytest.mark.parametrize("kind", [SGAConfig, OGAConfig])
def test_genomes_of_impossible_length_are_refused(kind: type[SGAConfig | OGAConfig], length: int) -> None:
    with pytest.raises(ValueError, match=f"genome_length: expected 1 to 32767, got {length}"):
        kind().build(length)


def test_one_compilation_serves_started_told_and_loaded_states() -> None:
    from sceann_hil.evolution import oga_generation, sga_generation

    for kind, module in ((SGAConfig, sga_generation), (OGAConfig, oga_generation)):
        algorithm = kind().build(24)
        state = _run(algorithm, 2)
        algorithm.tell(algorithm.load(algorithm.dump(state)), np.arange(25), np.random.default_rng(0))
        assert len(module.next_generation.signatures) == 1


def test_numba_is_not_imported_before_the_first_tell() -> None:
    code = (
        "import sys, sceann_hil.evolution as e; e.OGAConfig().build(24); e.SGAConfig().build(24);"
        "sys.exit('numba' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0

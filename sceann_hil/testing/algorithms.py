"""What every algorithm must do: state in, state out, and no randomness but the caller's."""

from __future__ import annotations

import json
import random
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.evolution import Algorithm, State
from sceann_hil.network.coding import Bits
from sceann_hil.plugins import AlgorithmConfig
from sceann_hil.testing.checks import check


class AlgorithmConformance(ABC):
    """Derive from it, name the class ``Test...``, and say which algorithm is meant.

    Fitness is the number of ones of a genome, so an algorithm for bits finds something to do.

    Attributes:
        genome_length: L, bits per genome.
        n_generations: how many generations are bred.
    """

    genome_length: int = 24
    n_generations: int = 6

    @abstractmethod
    def config(self) -> AlgorithmConfig:
        """The algorithm's configuration. Called once or more in every test."""

    # -- generations ------------------------------------------------------------------------------------------------

    def test_the_first_generation_is_a_population_of_bits_without_parents(self) -> None:
        """Shapes and types are those of `State`."""
        state = self._build().start(_rng())
        self._check_generation(state, "start")
        check(bool((state.parents == -1).all()), "start: expected parents -1 everywhere")

    def test_generations_keep_their_shape_and_name_their_parents(self) -> None:
        """Parents are places in the generation before, or -1."""
        for generation, state in enumerate(self._run()[1:], start=1):
            self._check_generation(state, f"generation {generation}")

    def test_given_genomes_become_the_first_generation(self) -> None:
        """They are taken in turn until the population is full; genomes of another length are refused."""
        algorithm, population = self._build(), self.config().population
        given = _rng(5).integers(0, 2, (3, self.genome_length), np.uint8)
        state = algorithm.adopt(given, _rng())
        self._check_generation(state, "adopt")
        expected = given[np.arange(population) % 3]
        check(np.array_equal(algorithm.ask(state), expected), "adopt: expected the given genomes in turn")
        _must_refuse(lambda: algorithm.adopt(given[:, :-1], _rng()), "adopt: genomes of another length")

    def test_structures_are_json_for_people(self) -> None:
        """One text, or None, for each individual."""
        algorithm = self._build()
        for state in self._run():
            structures = algorithm.structures(state)
            check(len(structures) == len(state.genomes), "structures: expected one for each individual")
            for text in structures:
                if text is not None:
                    json.loads(text)

    # -- state ------------------------------------------------------------------------------------------------------

    def test_resumed_from_any_state_it_goes_on_bit_for_bit(self) -> None:
        """A new object that loads the bytes of any generation breeds what the first one bred."""
        states = self._run()
        dumps = [self._build().dump(state) for state in states]
        for generation, data in enumerate(dumps):
            algorithm = self._build()
            state = algorithm.load(data)
            check(algorithm.dump(state) == data, f"generation {generation}: expected load and dump to give equal bytes")
            for later in range(generation + 1, len(dumps)):
                state = self._tell(algorithm, state, later)
                check(
                    algorithm.dump(state) == dumps[later],
                    f"resumed from generation {generation}: generation {later} differs. Whatever decides what comes "
                    f"next must be in the state, and all randomness from the generator that is passed",
                )

    def test_telling_changes_no_state(self) -> None:
        """States are values; the arrays of a state are read-only."""
        algorithm = self._build()
        for generation, state in enumerate(self._run()):
            before = algorithm.dump(state)
            self._tell(algorithm, state, generation + 1)
            check(algorithm.dump(state) == before, f"tell: it changed the state of generation {generation}")
            check(
                not (state.genomes.flags.writeable or state.parents.flags.writeable),
                f"generation {generation}: expected read-only arrays",
            )

    def test_damaged_bytes_are_refused(self) -> None:
        """A truncated state is a ValueError, and never a state."""
        algorithm = self._build()
        data = algorithm.dump(self._run()[-1])
        for size in {0, 1, len(data) // 2, len(data) - 1}:
            _must_refuse(lambda size=size: algorithm.load(data[:size]), f"load: {size} of {len(data)} bytes")

    # -- randomness -------------------------------------------------------------------------------------------------

    def test_the_same_generator_gives_the_same_run_and_another_one_another(self) -> None:
        """All randomness comes from the generator that is passed."""
        one, same, other = (self._last_dump(seed) for seed in (1, 1, 2))
        check(one == same, "the same generator gave two runs: something is drawn from elsewhere")
        check(one != other, "two generators gave the same run: expected all randomness from the generator")

    def test_nothing_is_drawn_from_global_generators(self) -> None:
        """Neither NumPy's nor Python's."""
        np.random.seed(7)  # noqa: NPY002
        random.seed(7)
        before = (np.random.get_state(), random.getstate())  # noqa: NPY002
        self._run()
        numpy_state, python_state = np.random.get_state(), random.getstate()  # noqa: NPY002
        check(
            all(np.array_equal(a, b) for a, b in zip(before[0], numpy_state, strict=True)),
            "it draws from NumPy's global generator; use the generator that is passed",
        )
        check(before[1] == python_state, "it draws from Python's global generator; use the generator that is passed")

    # -- fitness ----------------------------------------------------------------------------------------------------

    def test_a_fitness_that_is_not_one_finite_number_each_is_refused(self) -> None:
        """A failed trial is never a number, and no number is made of it."""
        algorithm = self._build()
        state = algorithm.start(_rng())
        fitness = np.zeros(len(state.genomes))
        for bad in (np.nan, np.inf):
            spoilt = fitness.copy()
            spoilt[-1] = bad
            _must_refuse(lambda spoilt=spoilt: self._told(algorithm, state, spoilt, _rng()), f"tell: fitness {bad}")
        _must_refuse(lambda: self._told(algorithm, state, fitness[1:], _rng()), "tell: one fitness too few")

    def test_only_the_order_of_fitness_counts_where_the_configuration_says_so(self) -> None:
        """`compares_only` allows races, which know no more than the order."""
        if not self.config().compares_only:
            return
        algorithm, state = self._build(), self._run()[-1]
        fitness = _ones(state.genomes)
        one, other = (self._told(algorithm, state, values, _rng()) for values in (fitness, np.exp(fitness) - 3.0))
        check(
            algorithm.dump(one) == algorithm.dump(other),
            "compares_only: the same order of other numbers gave another generation",
        )

    # -- helpers ----------------------------------------------------------------------------------------------------

    def _build(self) -> Algorithm[Any]:
        return self.config().build(self.genome_length)

    def _tell(self, algorithm: Algorithm[Any], state: State, generation: int, seed: int = 1) -> State:
        """The state of `generation`, from the one before and a generator of its own, as in a run."""
        genomes = algorithm.ask(state)
        rng = np.random.default_rng([seed, generation])
        return self._told(algorithm, state, _ones(genomes), rng)

    def _told(self, algorithm: Algorithm[Any], state: State, fitness: Any, rng: np.random.Generator) -> State:
        """The next state; measures are parts of ones in as many parts of the genome."""
        wanted = self.config().measures
        told: State
        if wanted:
            parts = np.array_split(algorithm.ask(state), len(wanted), axis=1)
            measures = np.stack([part.mean(axis=1) for part in parts], axis=1)
            told = algorithm.tell_with_measures(state, fitness, measures, rng)
        else:
            told = algorithm.tell(state, fitness, rng)
        return told

    def _run(self, seed: int = 1) -> list[State]:
        algorithm = self._build()
        states: list[State] = [algorithm.start(np.random.default_rng([seed, 0]))]
        for generation in range(1, self.n_generations):
            states.append(self._tell(algorithm, states[-1], generation, seed))
        return states

    def _last_dump(self, seed: int) -> bytes:
        return self._build().dump(self._run(seed)[-1])

    def _check_generation(self, state: State, where: str) -> None:
        population, genomes = self.config().population, self._build().ask(state)
        shape = (population, self.genome_length)
        check(genomes.shape == shape, f"{where}: expected genomes of shape {shape}, got {genomes.shape}")
        check(genomes.dtype == np.uint8, f"{where}: expected genomes of type uint8, got {genomes.dtype}")
        check(int(genomes.max(initial=0)) <= 1, f"{where}: expected bits, got {genomes.max(initial=0)}")
        check(state.parents.shape == (population,), f"{where}: expected a parent for each of {population} individuals")
        check(state.parents.dtype == np.int32, f"{where}: expected parents of type int32, got {state.parents.dtype}")
        low, high = int(state.parents.min()), int(state.parents.max())
        check(low >= -1 and high < population, f"{where}: expected parents in -1..{population - 1}, got {low}..{high}")


def _rng(seed: int = 0) -> np.random.Generator:
    return np.random.default_rng(seed)


def _ones(genomes: Bits) -> NDArray[np.float64]:
    return np.asarray(genomes.sum(axis=1), np.float64)


def _must_refuse(work: Any, what: str) -> None:
    try:
        work()
    except ValueError:
        return
    raise AssertionError(f"{what}: expected a ValueError")

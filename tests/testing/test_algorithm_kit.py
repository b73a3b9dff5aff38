"""The kit finds what is wrong with an algorithm."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray

from sceann_hil.evolution import RandomSearch, RandomSearchConfig, State
from sceann_hil.network.coding import Bits
from sceann_hil.testing import AlgorithmConformance


class _Sound(RandomSearch):
    """What is spoilt below."""


class _DrawsFromNumPysGlobalGenerator(_Sound):
    def tell(self, state: State, fitness: NDArray[np.float64], rng: np.random.Generator) -> State:
        np.random.random()  # noqa: NPY002
        return super().tell(state, fitness, rng)


class _DrawsFromPythonsGlobalGenerator(_Sound):
    def start(self, rng: np.random.Generator) -> State:
        random.random()
        return super().start(rng)


class _SeedsItself(_Sound):
    def tell(self, state: State, fitness: NDArray[np.float64], rng: np.random.Generator) -> State:
        return super().tell(state, fitness, np.random.default_rng())


class _IgnoresTheGenerator(_Sound):
    def start(self, rng: np.random.Generator) -> State:
        return super().start(np.random.default_rng(1))

    def tell(self, state: State, fitness: NDArray[np.float64], rng: np.random.Generator) -> State:
        return super().tell(state, fitness, np.random.default_rng(1))


class _RemembersBesidesItsState(_Sound):
    told = 0

    def tell(self, state: State, fitness: NDArray[np.float64], rng: np.random.Generator) -> State:
        self.told += 1
        rng.random(self.told)
        return super().tell(state, fitness, rng)


class _GradesWhatFailed(_Sound):
    def tell(self, state: State, fitness: NDArray[np.float64], rng: np.random.Generator) -> State:
        return super().tell(state, np.nan_to_num(np.asarray(fitness), posinf=0.0), rng)


class _ForgetsParents(_Sound):
    def load(self, data: bytes) -> State:
        state = super().load(data)
        return replace(state, parents=np.full(self.population, -1, np.int32))


class _NamesNoSuchParent(_Sound):
    def tell(self, state: State, fitness: NDArray[np.float64], rng: np.random.Generator) -> State:
        told = super().tell(state, fitness, rng)
        parents = np.full(self.population, self.population, np.int32)
        parents.flags.writeable = False
        return replace(told, parents=parents)


class _LetsItsStateBeChanged(_Sound):
    def start(self, rng: np.random.Generator) -> State:
        return replace(super().start(rng), genomes=super().start(rng).genomes.copy())


class _BelievesDamagedBytes(_Sound):
    def load(self, data: bytes) -> State:
        try:
            return super().load(data)
        except ValueError:
            return self.start(np.random.default_rng(0))


class _UsesMoreThanTheOrder(_Sound):
    def tell(self, state: State, fitness: NDArray[np.float64], rng: np.random.Generator) -> State:
        told = super().tell(state, fitness, rng)
        return told if float(np.max(fitness)) < 100.0 else super().tell(state, -np.asarray(fitness), rng)


class _AdoptsAnything(_Sound):
    def adopt(self, genomes: Bits, rng: np.random.Generator) -> State:
        return self.start(rng)


def _problems(algorithm: type[RandomSearch]) -> dict[str, str]:
    """What the kit says of an algorithm, by the name of the test."""

    class Config(RandomSearchConfig):
        made: ClassVar[Callable[..., RandomSearch]] = algorithm

        def build(self, genome_length: int) -> RandomSearch:
            return type(self).made(genome_length, self)

    class Kit(AlgorithmConformance):
        def config(self) -> RandomSearchConfig:
            return Config()

    found = {}
    for name in [name for name in dir(Kit) if name.startswith("test_")]:
        test: Any = getattr(Kit(), name)
        try:
            test()
        except Exception as error:
            found[name] = str(error)
    return found


def test_a_sound_algorithm_has_no_problems() -> None:
    assert _problems(_Sound) == {}


@pytest.mark.parametrize(
    ("algorithm", "message"),
    [
        (_DrawsFromNumPysGlobalGenerator, "it draws from NumPy's global generator"),
        (_DrawsFromPythonsGlobalGenerator, "it draws from Python's global generator"),
        (_SeedsItself, "something is drawn from elsewhere"),
        (_IgnoresTheGenerator, "two generators gave the same run"),
        (_RemembersBesidesItsState, "Whatever decides what comes next must be in the state"),
        (_GradesWhatFailed, "tell: fitness nan: expected a ValueError"),
        (_ForgetsParents, "expected load and dump to give equal bytes"),
        (_NamesNoSuchParent, "expected parents in -1..24"),
        (_LetsItsStateBeChanged, "expected read-only arrays"),
        (_BelievesDamagedBytes, "expected a ValueError"),
        (_UsesMoreThanTheOrder, "the same order of other numbers gave another generation"),
        (_AdoptsAnything, "adopt: expected the given genomes in turn"),
    ],
)
def test_what_is_wrong_is_found(algorithm: type[RandomSearch], message: str) -> None:
    assert any(message in problem for problem in _problems(algorithm).values())

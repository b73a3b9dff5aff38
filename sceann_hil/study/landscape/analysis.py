"""What a landscape looks like: solutions, their neighbours, the distribution of fitness, and how hard search is."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sceann_hil.study.landscape.files import Landscape

_SOLUTIONS, _SUMMARY = "solutions.npy", "summary.json"
_QUANTILES = (0.0, 0.01, 0.1, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999, 0.9999, 1.0)
_AT_ONCE = 1 << 20


@dataclass(frozen=True, slots=True)
class Summary:
    """What was found (N = 2**L genomes).

    Attributes:
        length: L, bits.
        n_genomes: N.
        n_solutions: genomes that succeeded in every trial.
        fraction: n_solutions / N.
        best_fitness: of all genomes.
        mean_fitness: of all genomes.
        quantiles: fitness at these fractions of all genomes, as pairs (fraction, fitness).
        neighbours_mean: of a solution's L one-bit neighbours, how many are solutions too; 0 without solutions.
        neighbours_expected: how many they would be if solutions lay anywhere.
        isolated: solutions without any neighbour that is one.
        budget: genomes that the configuration's algorithm evaluates.
        random_search: probability that so many random genomes contain a solution.
        random_search_best: expected best fitness among so many random genomes.
    """

    length: int
    n_genomes: int
    n_solutions: int
    fraction: float
    best_fitness: float
    mean_fitness: float
    quantiles: tuple[tuple[float, float], ...]
    neighbours_mean: float
    neighbours_expected: float
    isolated: int
    budget: int
    random_search: float
    random_search_best: float


def analyse(landscape: Landscape) -> Summary:
    """Everything about a complete landscape; also written beside it, with the list of solutions."""
    path = landscape.directory / _SUMMARY
    if path.is_file():
        return _read(path)
    config = landscape.config
    length, n_trials = config.genome_length, config.build_task().n_trials
    n = 1 << length
    successes = landscape.successes
    parts = [first + np.flatnonzero(successes[first : first + _AT_ONCE] == n_trials) for first in range(0, n, _AT_ONCE)]
    solutions = np.concatenate(parts).astype(np.int64)
    neighbours = solution_neighbours(solutions, successes, n_trials, length)
    ordered = np.sort(landscape.fitness)
    budget = config.algorithm.population * (config.algorithm.generations + 1)
    summary = Summary(
        length=length,
        n_genomes=n,
        n_solutions=len(solutions),
        fraction=len(solutions) / n,
        best_fitness=float(ordered[-1]),
        mean_fitness=float(ordered.mean(dtype=np.float64)),
        quantiles=tuple((q, float(ordered[round(q * (n - 1))])) for q in _QUANTILES),
        neighbours_mean=float(neighbours.mean()) if len(solutions) else 0.0,
        neighbours_expected=length * max(len(solutions) - 1, 0) / (n - 1),
        isolated=int((neighbours == 0).sum()),
        budget=budget,
        random_search=1.0 - (1.0 - len(solutions) / n) ** budget,
        random_search_best=expected_best(ordered, budget),
    )
    np.save(landscape.directory / _SOLUTIONS, solutions)
    path.write_text(json.dumps(asdict(summary), indent=2) + "\n", encoding="utf-8")
    return summary


def solution_neighbours(
    solutions: NDArray[np.int64], successes: NDArray[np.uint16], n_trials: int, length: int
) -> NDArray[np.int64]:
    """How many of each solution's one-bit neighbours are solutions, shape ``(len(solutions),)``."""
    count = np.zeros(len(solutions), np.int64)
    for bit in range(length):
        count += successes[solutions ^ (1 << bit)] == n_trials
    return count


def expected_best(ordered: NDArray[np.float32], draws: int) -> float:
    """Expected largest of `draws` independent draws from values in ascending order."""
    n, total, below = len(ordered), 0.0, 0.0
    for first in range(0, n, _AT_ONCE):
        part = ordered[first : first + _AT_ONCE].astype(np.float64)
        ranks = np.arange(first + 1, first + len(part) + 1) / n
        largest = np.exp(draws * np.log(ranks))
        total += float((part * np.diff(largest, prepend=below)).sum())
        below = float(largest[-1])
    return total


def champion_ranks(landscape: Landscape, genomes: Sequence[str]) -> NDArray[np.int64]:
    """Place of each genome (hexadecimal) among all: 1 + the number of genomes that are strictly fitter."""
    length = landscape.config.genome_length
    spare = -length % 8
    numbers = np.array([int(genome, 16) >> spare for genome in genomes], np.int64)
    fitness = landscape.fitness
    levels, places = np.unique(fitness[numbers], return_inverse=True)
    fitter = np.zeros(len(levels), np.int64)
    for first in range(0, len(fitness), _AT_ONCE):
        part = np.sort(fitness[first : first + _AT_ONCE])
        fitter += len(part) - np.searchsorted(part, levels, side="right")
    return 1 + fitter[places]


def _read(path: Path) -> Summary:
    found = json.loads(path.read_text(encoding="utf-8"))
    quantiles = tuple((q, value) for q, value in found.pop("quantiles"))
    return Summary(quantiles=quantiles, **found)

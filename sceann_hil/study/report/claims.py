"""The paper's claims as comparisons of cell means, each of which should be positive."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sceann_hil.network.coding import Coding
from sceann_hil.study.report.cells import Cell, Key
from sceann_hil.study.statistics import FEWEST_RUNS, Interval, Statement, Verdict, contrast, judge, strict_level

Samples = Mapping[Key, NDArray[np.float64]]
Weights = dict[Key, float]
Comparison = tuple[str, Weights]
"""What is compared, and the contrast that should be positive."""

HIDDEN = (1, 2, 3, 4, 5)
ALGORITHMS = ("sga", "oga")
_MOST_EXAMPLES = 2


@dataclass(frozen=True)
class Claim:
    """A claim of the paper and what our runs say of it.

    Attributes:
        number: for references, such as G1.
        text: the claim, in the paper's words as far as they fit.
        verdict: what our runs say.
        evidence: why, in numbers.
    """

    number: str
    text: str
    verdict: Verdict
    evidence: str


def fitness_samples(cells: Mapping[Key, Cell]) -> dict[Key, NDArray[np.float64]]:
    """Champions' fitness of every cell."""
    return {key: cell.fitness for key, cell in cells.items()}


def success_samples(cells: Mapping[Key, Cell]) -> dict[Key, NDArray[np.float64]]:
    """1 for every run that succeeded, 0 for the others, of every cell."""
    return {key: cell.succeeded.astype(np.float64) for key, cell in cells.items()}


def compare(
    number: str, text: str, samples: Samples, comparisons: Iterable[Comparison], unit: Callable[[float], str]
) -> Claim:
    """A claim that says that every comparison is positive."""
    listed = list(comparisons)
    level = strict_level(len(listed))
    statements = [
        Statement(name, contrast(samples, weights), contrast(samples, weights, level)) for name, weights in listed
    ]
    fewest = min(len(samples[key]) for _, weights in listed for key in weights)
    verdict = judge(statements) if fewest >= FEWEST_RUNS else Verdict.CANNOT_TELL
    few = "" if fewest >= FEWEST_RUNS else f"; {fewest} runs of a condition, at least {FEWEST_RUNS} are needed"
    return Claim(number, text, verdict, evidence_of(statements, unit) + few)


def evidence_of(statements: Sequence[Statement], unit: Callable[[float], str]) -> str:
    """What the comparisons say, most telling first."""

    def shown(interval: Interval) -> str:
        return f"{_signed(interval.estimate, unit)} [{_signed(interval.low, unit)}, {_signed(interval.high, unit)}]"

    if len(statements) <= _MOST_EXAMPLES + 1:
        return "; ".join(f"{statement.name}: {shown(statement.interval)}" for statement in statements)
    of = {verdict: [s for s in statements if s.verdict is verdict] for verdict in Verdict}
    positive = sum(statement.interval.estimate > 0 for statement in statements)
    text = (
        f"{positive} of {len(statements)} comparisons point this way, {len(of[Verdict.HOLDS])} of them significantly; "
        f"{len(of[Verdict.DOES_NOT_HOLD])} contradict significantly"
    )
    against = sorted(of[Verdict.DOES_NOT_HOLD], key=lambda statement: statement.interval.estimate)
    weakest = against or sorted(statements, key=lambda statement: statement.interval.estimate)
    examples = "; ".join(f"{s.name} {shown(s.interval)}" for s in weakest[:_MOST_EXAMPLES])
    return f"{text}. {'Against it' if against else 'Weakest'}: {examples}"


def mean_of(keys: Iterable[Key]) -> Weights:
    """The mean of some cells' means."""
    listed = list(keys)
    return {key: 1.0 / len(listed) for key in listed}


def minus(one: Weights, other: Weights) -> Weights:
    """A difference of two weighted sums."""
    return {key: one.get(key, 0.0) - other.get(key, 0.0) for key in {**one, **other}}


def rising(coding: Coding, algorithm: str, sensors: Sequence[int], order: Sequence[int]) -> Iterator[Comparison]:
    """Mean over the numbers of sensors rises along an order of the numbers of hidden neurons."""
    for low, high in pairwise(order):
        yield (
            f"{coding.name} {algorithm.upper()} N_h {low} → {high}",
            minus(
                mean_of(Key(coding, algorithm, n_sensors, high) for n_sensors in sensors),
                mean_of(Key(coding, algorithm, n_sensors, low) for n_sensors in sensors),
            ),
        )


def rising_in_every_column(
    coding: Coding, algorithm: str, sensors: Sequence[int], order: Sequence[int]
) -> Iterator[Comparison]:
    """The same for every number of sensors by itself."""
    for n_sensors in sensors:
        for low, high in pairwise(order):
            yield (
                f"{coding.name} {algorithm.upper()} N_s={n_sensors}, N_h {low} → {high}",
                {Key(coding, algorithm, n_sensors, high): 1.0, Key(coding, algorithm, n_sensors, low): -1.0},
            )


def slope(coding: Coding, algorithm: str, sensors: Sequence[int], hidden: Sequence[int], sign: float) -> Comparison:
    """The straight line over the numbers of hidden neurons, mean over the numbers of sensors; per neuron."""
    middle = sum(hidden) / len(hidden)
    spread = sum((n_hidden - middle) ** 2 for n_hidden in hidden)
    weights = {
        Key(coding, algorithm, n_sensors, n_hidden): sign * (n_hidden - middle) / spread / len(sensors)
        for n_sensors in sensors
        for n_hidden in hidden
    }
    way = "rise" if sign > 0 else "fall"
    return f"{coding.name} {algorithm.upper()} {way} per hidden neuron", weights


def oga_above_sga(codings: Sequence[Coding], sensors: Sequence[int], hidden: Sequence[int]) -> Iterator[Comparison]:
    """OGA minus SGA in every cell."""
    for coding in codings:
        for n_sensors in sensors:
            for n_hidden in hidden:
                one, other = (Key(coding, algorithm, n_sensors, n_hidden) for algorithm in ("oga", "sga"))
                yield f"{coding.name} ({n_sensors},{n_hidden})", {one: 1.0, other: -1.0}


def oga_above_sga_on_average(
    codings: Sequence[Coding], sensors: Sequence[int], hidden: Sequence[int]
) -> Iterator[Comparison]:
    """The same as one mean over all cells, and one for each coding."""
    groups = [("all cells", codings), *((coding.name, [coding]) for coding in codings)]
    for name, members in groups if len(codings) > 1 else groups[:1]:
        keys = [(c, s, h) for c in members for s in sensors for h in hidden]
        yield (
            name,
            minus(mean_of(Key(c, "oga", s, h) for c, s, h in keys), mean_of(Key(c, "sga", s, h) for c, s, h in keys)),
        )


def complete(cells: Mapping[Key, Cell], codings: Sequence[Coding], sensors: Sequence[int]) -> bool:
    """Whether every cell of the grid has at least two runs."""
    wanted = (Key(c, a, s, h) for c in codings for a in ALGORITHMS for s in sensors for h in HIDDEN)
    return all(key in cells and cells[key].n > 1 for key in wanted)


def _signed(value: float, unit: Callable[[float], str]) -> str:
    return f"{'-' if value < 0 else '+'}{unit(abs(value))}"

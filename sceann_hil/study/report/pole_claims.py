"""What the paper says of pole balancing (Section IV.C and V), tested on a study like ``configs/paper/fig10.yaml``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from sceann_hil.network.coding import Coding
from sceann_hil.study.report.cells import Cell, Key
from sceann_hil.study.report.claims import (
    ALGORITHMS,
    HIDDEN,
    Claim,
    Comparison,
    compare,
    fitness_samples,
    minus,
    oga_above_sga,
    oga_above_sga_on_average,
    rising,
    slope,
    success_samples,
)
from sceann_hil.study.statistics import FEWEST_RUNS, Verdict, mean_interval, wilson

SENSORS = (2, 4)
EARLY = 0.1
"""How we read "in the early time steps": before this part of a trial is over."""
_TWO, _THREE = Coding.SCEANN2, Coding.SCEANN3


def pole_claims(cells: Mapping[Key, Cell]) -> list[Claim]:
    """All claims; needs the complete grid of Fig. 10."""
    samples, rates = fitness_samples(cells), success_samples(cells)

    def steps(value: float) -> str:
        return f"{value:.0f}"

    def percent(value: float) -> str:
        return f"{100 * value:.1f}"

    return [
        _fails_early(cells),
        compare(
            "P2",
            "SCEANN2: fitness falls as N_h rises, for both algorithms (trend over N_h, mean over N_s).",
            samples,
            [slope(_TWO, algorithm, SENSORS, HIDDEN, -1.0) for algorithm in ALGORITHMS],
            steps,
        ),
        compare(
            "P3a",
            "SCEANN3: fitness rises with N_h up to 3 or 4 (read as: N_h = 3 and 4 above 1 and 2, mean over N_s).",
            samples,
            [c for a in ALGORITHMS for low in (1, 2) for n in (3, 4) for c in rising(_THREE, a, SENSORS, (low, n))],
            steps,
        ),
        compare(
            "P3b",
            "SCEANN3: fitness rises with N_h (read strictly: at every step from 1 to 4, mean over N_s).",
            samples,
            [c for a in ALGORITHMS for c in rising(_THREE, a, SENSORS, (1, 2, 3, 4))],
            steps,
        ),
        compare(
            "P3c",
            "SCEANN3: fitness falls when N_h exceeds 4.",
            samples,
            [c for a in ALGORITHMS for c in rising(_THREE, a, SENSORS, (5, 4))],
            steps,
        ),
        compare(
            "P4a",
            "SCEANN3: fitness is higher for N_s = 2 than for N_s = 4, for both algorithms and every N_h.",
            samples,
            [_fewer_sensors(_THREE, algorithm, n_hidden) for algorithm in ALGORITHMS for n_hidden in HIDDEN],
            steps,
        ),
        compare(
            "P4b",
            "The difference between N_s = 2 and 4 is more pronounced for SCEANN3 than for SCEANN2 (mean over N_h).",
            samples,
            [_more_pronounced(algorithm) for algorithm in ALGORITHMS],
            steps,
        ),
        compare(
            "P5a",
            "SCEANN2 and SCEANN3: the OGA performs better than the SGA (read as: on average).",
            samples,
            oga_above_sga_on_average((_TWO, _THREE), SENSORS, HIDDEN),
            steps,
        ),
        compare(
            "P5b",
            "SCEANN2 and SCEANN3: the OGA performs better than the SGA for each N_s and N_h.",
            samples,
            oga_above_sga((_TWO, _THREE), SENSORS, HIDDEN),
            steps,
        ),
        compare(
            "P6a",
            "SCEANN3 performs best with N_h = 3, for both algorithms (success rate in %, N_s = 2 and 4).",
            rates,
            [_best_hidden(a, n_sensors, n) for a in ALGORITHMS for n_sensors in SENSORS for n in (1, 2, 4, 5)],
            percent,
        ),
        compare(
            "P6b",
            "SCEANN3 with (N_s, N_h) = (2, 3) by the OGA is the best of all conditions (success rate in %).",
            rates,
            _best_of_all(rates),
            percent,
        ),
        _many_runs(cells),
    ]


def _fails_early(cells: Mapping[Key, Cell]) -> Claim:
    ours = {key: cell for key, cell in cells.items() if key.coding is Coding.SCEANN1}
    limit = EARLY * next(iter(ours.values())).condition.config.build_task().max_steps
    intervals = {key: mean_interval(cell.fitness) for key, cell in ours.items()}
    highest = max(intervals, key=lambda key: intervals[key].estimate)
    k, n = (sum(values) for values in zip(*(cell.rate for cell in ours.values()), strict=True))
    verdict = Verdict.CANNOT_TELL
    enough = min(cell.n for cell in ours.values()) >= FEWEST_RUNS
    if (
        k == 0
        and enough
        and wilson(k, n).high < EARLY
        and all(interval.high < limit for interval in intervals.values())
    ):
        verdict = Verdict.HOLDS
    elif (enough and intervals[highest].low > limit) or wilson(k, n).low > EARLY:
        verdict = Verdict.DOES_NOT_HOLD
    top = intervals[highest]
    return Claim(
        "P1",
        f"SCEANN1 loses its balance in the early time steps under all conditions (read as: no run succeeds, and every "
        f"mean stays below {EARLY:.0%} of the steps).",
        verdict,
        f"{k} of {n:,} runs succeed; highest mean {top.estimate:.0f} [{top.low:.0f}, {top.high:.0f}] steps at "
        f"({highest.n_sensors},{highest.n_hidden}) by the {highest.algorithm.upper()}",
    )


def _fewer_sensors(coding: Coding, algorithm: str, n_hidden: int) -> Comparison:
    two, four = (Key(coding, algorithm, n_sensors, n_hidden) for n_sensors in SENSORS)
    return f"{algorithm.upper()} N_h={n_hidden}", {two: 1.0, four: -1.0}


def _more_pronounced(algorithm: str) -> Comparison:
    weights: dict[Key, float] = {}
    for coding, sign in ((_THREE, 1.0), (_TWO, -1.0)):
        for n_hidden in HIDDEN:
            _, difference = _fewer_sensors(coding, algorithm, n_hidden)
            weights = minus(weights, {key: -sign * w / len(HIDDEN) for key, w in difference.items()})
    return algorithm.upper(), weights


def _best_hidden(algorithm: str, n_sensors: int, n_hidden: int) -> Comparison:
    best, other = (Key(_THREE, algorithm, n_sensors, n) for n in (3, n_hidden))
    return f"{algorithm.upper()} N_s={n_sensors}, N_h 3 above {n_hidden}", {best: 1.0, other: -1.0}


def _best_of_all(rates: Mapping[Key, object]) -> Iterator[Comparison]:
    best = Key(_THREE, "oga", 2, 3)
    for key in rates:
        if key != best:
            yield (
                f"above {key.coding.name} ({key.n_sensors},{key.n_hidden}) {key.algorithm.upper()}",
                {best: 1.0, key: -1.0},
            )


def _many_runs(cells: Mapping[Key, Cell]) -> Claim:
    ours = [cell.rate for key, cell in cells.items() if key.coding is _THREE and key.n_hidden >= 3]
    k, n = (sum(values) for values in zip(*ours, strict=True))
    rate = wilson(k, n)
    return Claim(
        "P7",
        "Controllers that balance for the maximum time are obtained in many runs (read as: SCEANN3 with N_h of 3 or "
        "more finds one in more than 10 % of its runs).",
        Verdict.HOLDS if rate.low > 0.1 else Verdict.DOES_NOT_HOLD if rate.high < 0.1 else Verdict.CANNOT_TELL,
        f"{rate.estimate:.1%} [{rate.low:.1%}, {rate.high:.1%}] of {n:,} runs",
    )

"""What the paper says of goal reach (Section III.C, Section V), tested on a study like ``configs/paper/fig6.yaml``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

from sceann_hil.network.coding import Coding
from sceann_hil.study.report.cells import Cell, Key
from sceann_hil.study.report.claims import (
    ALGORITHMS,
    HIDDEN,
    Claim,
    Comparison,
    compare,
    fitness_samples,
    mean_of,
    minus,
    oga_above_sga,
    oga_above_sga_on_average,
    rising,
    slope,
)
from sceann_hil.study.statistics import Verdict, wilson

SENSORS = (1, 2, 3, 5, 7)
_CODINGS = tuple(Coding)
_ORDER = (1, 5, 3, 4, 2)
_BEST_CODING = {
    "sga": {1: Coding.SCEANN1, 2: Coding.SCEANN1, 3: Coding.SCEANN1, 4: Coding.SCEANN3, 5: Coding.SCEANN3},
    "oga": {1: Coding.SCEANN1, 2: Coding.SCEANN3, 3: Coding.SCEANN1, 4: Coding.SCEANN3, 5: Coding.SCEANN3},
}
ALMOST_ALL = 0.95
"""How we read "almost all runs"."""


def goal_claims(cells: Mapping[Key, Cell]) -> list[Claim]:
    """All claims; needs the complete grid of Fig. 6."""
    samples = fitness_samples(cells)

    def points(value: float) -> str:
        return f"{value:.3f}"

    few = (Coding.SCEANN1, Coding.SCEANN2)
    return [
        compare(
            "G1a",
            "Fitness rises with N_s (read as a trend: N_s = 7 above N_s = 1, mean over N_h).",
            samples,
            _ends(),
            points,
        ),
        compare(
            "G1b", "Fitness rises with N_s (read strictly: at every step, for every N_h).", samples, _steps(), points
        ),
        compare(
            "G2a",
            "SCEANN1, SCEANN2: fitness rises as N_h falls (read as a trend, mean over N_s).",
            samples,
            [slope(coding, algorithm, SENSORS, HIDDEN, -1.0) for coding in few for algorithm in ALGORITHMS],
            points,
        ),
        compare(
            "G2b",
            "SCEANN1, SCEANN2: fitness rises as N_h falls (read strictly: at every step, mean over N_s).",
            samples,
            [c for coding in few for a in ALGORITHMS for c in rising(coding, a, SENSORS, HIDDEN[::-1])],
            points,
        ),
        compare(
            "G3a",
            "SCEANN3 performs worst with N_h = 1, for both algorithms.",
            samples,
            [c for a in ALGORITHMS for n in HIDDEN[1:] for c in rising(Coding.SCEANN3, a, SENSORS, (1, n))],
            points,
        ),
        compare(
            "G3b",
            "SCEANN3: fitness rises in the order N_h = 1 → 5 → 3 → 4 → 2, for both algorithms.",
            samples,
            [c for a in ALGORITHMS for c in rising(Coding.SCEANN3, a, SENSORS, _ORDER)],
            points,
        ),
        *(
            compare(
                f"G4 {algorithm.upper()} {n_hidden}",
                f"{algorithm.upper()}, N_h = {n_hidden}: {best.name} is the best coding (mean over N_s).",
                samples,
                _best_coding(algorithm, n_hidden, best),
                points,
            )
            for algorithm, by_hidden in _BEST_CODING.items()
            for n_hidden, best in by_hidden.items()
        ),
        compare(
            "G5a",
            "The OGA performs better than the SGA (read as: on average).",
            samples,
            oga_above_sga_on_average(_CODINGS, SENSORS, HIDDEN),
            points,
        ),
        compare(
            "G5b",
            "The OGA performs better than the SGA for each N_s and N_h.",
            samples,
            oga_above_sga(_CODINGS, SENSORS, HIDDEN),
            points,
        ),
        *_reached(cells),
    ]


def _ends() -> Iterator[Comparison]:
    for coding in _CODINGS:
        for algorithm in ALGORITHMS:
            most, least = (
                mean_of(Key(coding, algorithm, n_sensors, n_hidden) for n_hidden in HIDDEN)
                for n_sensors in (SENSORS[-1], SENSORS[0])
            )
            yield f"{coding.name} {algorithm.upper()} N_s 1 → 7", minus(most, least)


def _steps() -> Iterator[Comparison]:
    for coding in _CODINGS:
        for algorithm in ALGORITHMS:
            for n_hidden in HIDDEN:
                for low, high in pairwise(SENSORS):
                    yield (
                        f"{coding.name} {algorithm.upper()} N_h={n_hidden}, N_s {low} → {high}",
                        {Key(coding, algorithm, high, n_hidden): 1.0, Key(coding, algorithm, low, n_hidden): -1.0},
                    )


def _best_coding(algorithm: str, n_hidden: int, best: Coding) -> Iterator[Comparison]:
    for other in _CODINGS:
        if other is not best:
            mine, theirs = (
                mean_of(Key(coding, algorithm, n_sensors, n_hidden) for n_sensors in SENSORS)
                for coding in (best, other)
            )
            yield f"above {other.name}", minus(mine, theirs)


def _reached(cells: Mapping[Key, Cell]) -> Iterator[Claim]:
    texts = {
        "G6a": ("in at least one of its 8 trials", [cell.reached for cell in cells.values()]),
        "G6b": ("in all of its 8 trials", [cell.succeeded for cell in cells.values()]),
    }
    for number, (how, groups) in texts.items():
        k, n = sum(int(group.sum()) for group in groups), sum(len(group) for group in groups)
        rate = wilson(k, n)
        lowest = min(float(group.mean()) for group in groups)
        verdict = Verdict.CANNOT_TELL
        if rate.low > ALMOST_ALL:
            verdict = Verdict.HOLDS
        elif rate.high < ALMOST_ALL:
            verdict = Verdict.DOES_NOT_HOLD
        yield Claim(
            number,
            f"The goal is reached in almost all runs (read as: in at least {ALMOST_ALL:.0%} of them the champion "
            f"reaches it {how}).",
            verdict,
            f"{rate.estimate:.2%} [{rate.low:.2%}, {rate.high:.2%}] of {n:,} runs; lowest cell {lowest:.0%}",
        )

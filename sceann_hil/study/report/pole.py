"""The report's section on pole balancing: Tables I and II, Fig. 10, 11, 12 and the claims."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from sceann_hil.network.coding import Coding
from sceann_hil.study.report import paper
from sceann_hil.study.report.behaviour import Champion, best_champion, draw_fig11, swings
from sceann_hil.study.report.cells import Cell, Key, StudyData
from sceann_hil.study.report.claims import Claim, complete
from sceann_hil.study.report.network import draw_network
from sceann_hil.study.report.page import Page
from sceann_hil.study.report.panels import draw_fig10
from sceann_hil.study.report.pole_claims import SENSORS, pole_claims
from sceann_hil.study.report.wording import claims_table, percent, runs_sentence
from sceann_hil.study.statistics import Verdict, fisher, rate_difference, sees_rate_difference, wilson

_BEST = Key(Coding.SCEANN3, "oga", 2, 3)
NOTICEABLE = 0.25
"""A difference between two success rates that the paper's 50 runs and enough of ours would show."""
_LARGE = 3
"""Fewer hidden neurons never succeed."""
_WHY_OGA = "the paper does not define the OGA; ours is a reconstruction (OGA-R)"
_WHY_VELOCITIES = "the paper does not give the ranges that scale the velocities"


def tables_section(page: Page, study: StudyData) -> list[Claim]:
    """Tables I and II beside ours."""
    cells = study.by_key
    page.heading("Tables I and II: success rate of SCEANN3 on pole balancing")
    page.text(
        runs_sentence(study),
        "Success is a champion that balances for all 3,000 steps. Each entry: the paper's rate (50 runs) with its 95 % "
        "Wilson interval; ours with its interval; and the p value of Fisher's exact test that the two are equal. An "
        "entry *agrees* if the 95 % interval of the difference (Newcombe) contains 0 and so many runs would have told "
        f"a difference of {100 * NOTICEABLE:.0f} percentage points (with 80 % probability); without these we "
        "*cannot tell*.",
    )
    claims = []
    for number, algorithm in (("I", "sga"), ("II", "oga")):
        page.heading(f"Table {number}: {algorithm.upper()}", 3)
        keys = [key for key in paper.SUCCESS_PERCENT if key.algorithm == algorithm and key in cells]
        found = {key: _entry(cells[key].rate, _printed([key])) for key in keys}
        outside = [key for key in keys if found[key] is Verdict.DOES_NOT_HOLD]
        agreeing = sum(verdict is Verdict.HOLDS for verdict in found.values())
        rows = [[f"{key.n_sensors}", f"{key.n_hidden}", *_beside(_printed([key]), cells[key].rate)] for key in keys]
        large = [key for key in keys if key.n_hidden >= _LARGE]
        theirs, ours = _printed(large), _pooled([cells[key] for key in large])
        rows.append(["both", f"{_LARGE} to 5", *_beside(theirs, ours)])
        page.table(["N_s", "N_h", "paper: % [95 %]", "ours: % [95 %]", "p", ""], rows)
        page.bullets([_why_outside(key) for key in outside])
        names = "".join(f"; not ({key.n_sensors},{key.n_hidden})" for key in outside)
        claims.append(
            Claim(
                f"T {number}",
                f"The success rates of Table {number} agree with ours (95 % interval of each difference contains 0, "
                f"and {100 * NOTICEABLE:.0f} points would have been seen).",
                _table_verdict(found.values()),
                f"{agreeing} of {len(keys)} entries agree{names}; all entries with N_h of {_LARGE} "
                f"or more together: paper {percent(wilson(*theirs))} %, ours {percent(wilson(*ours))} %, p = "
                f"{fisher(ours, theirs):.2g}",
            )
        )
    page.text("Of 20 entries that are equal in truth, one is expected to differ by chance.")
    claims_table(page, claims)
    return claims


def _printed(keys: Sequence[Key]) -> tuple[int, int]:
    """The paper's successes and runs in some entries together."""
    return sum(paper.successes(key) for key in keys), paper.RUNS * len(keys)


def _pooled(cells: Sequence[Cell]) -> tuple[int, int]:
    """Our successes and runs in some cells together."""
    return sum(cell.rate[0] for cell in cells), sum(cell.n for cell in cells)


def _entry(ours: tuple[int, int], theirs: tuple[int, int]) -> Verdict:
    """Whether two rates agree: only where a difference that matters would have been seen."""
    if not rate_difference(ours, theirs).contains_zero:
        return Verdict.DOES_NOT_HOLD
    seen = sees_rate_difference(theirs[0] / theirs[1], theirs[1], ours[1], NOTICEABLE)
    return Verdict.HOLDS if seen else Verdict.CANNOT_TELL


def _table_verdict(entries: Iterable[Verdict]) -> Verdict:
    """Of a whole table: one entry that differs is enough, and one that cannot be told leaves it open."""
    listed = set(entries)
    return next((v for v in (Verdict.DOES_NOT_HOLD, Verdict.CANNOT_TELL) if v in listed), Verdict.HOLDS)


def _beside(theirs: tuple[int, int], ours: tuple[int, int]) -> list[str]:
    words = {Verdict.HOLDS: "agrees", Verdict.DOES_NOT_HOLD: "**differs**", Verdict.CANNOT_TELL: "cannot tell"}
    verdict = words[_entry(ours, theirs)]
    return [percent(wilson(*theirs)), f"**{percent(wilson(*ours))}**", f"{fisher(ours, theirs):.2g}", verdict]


def _why_outside(key: Key) -> str:
    reasons = [_WHY_OGA] if key.algorithm == "oga" else []
    reasons += [_WHY_VELOCITIES] if key.n_sensors == 4 else []
    name = f"{key.algorithm.upper()}, N_s = {key.n_sensors}, N_h = {key.n_hidden}"
    return f"{name} differs. What is open here: {'; '.join(reasons) or 'nothing that we know of'}."


def fig10_section(page: Page, study: StudyData) -> list[Claim]:
    """Fig. 10 and the claims that the paper makes with it."""
    cells = study.by_key
    page.heading("Fig. 10: pole balancing, all codings")
    page.text(runs_sentence(study))
    if not complete(cells, tuple(Coding), SENSORS):
        page.text("The grid is not complete; run the study to its end for the figure and the claims.")
        return []
    caption = "Fig. 10: maximum fitness in the last generation, mean over the runs with 95 % intervals."
    page.figure("fig10", caption, partial(draw_fig10, cells, SENSORS))
    claims = pole_claims(cells)
    claims_table(page, claims)
    return claims


def best_section(page: Page, cells: Mapping[Key, Cell]) -> list[Claim]:
    """Fig. 11 and 12: the best SCEANN3 (2,3) by the OGA."""
    if _BEST not in cells:
        return []
    champion = best_champion(cells[_BEST])
    x_m, angle_deg, lasted = swings(champion)
    page.heading("Fig. 11 and 12: the best controller of SCEANN3 (2,3) by the OGA")
    page.text(
        f"Champion of run {champion.run}: {champion.fitness:.0f} steps. Among equally fit champions (the first fifty) "
        f"it is the one whose cart moves least: at most {x_m:.2g} m from the middle (the track ends at 2.4 m), the "
        f"pole at most {angle_deg:.2g} degrees from vertical (it falls at 36)."
    )
    page.figure("fig11", "Fig. 11: cart position and pole angle.", partial(draw_fig11, champion))
    page.figure("fig12", "Fig. 12: its network; solid excitatory, dashed inhibitory.", partial(_draw_network, champion))
    claim = Claim(
        "P8",
        "The best SCEANN3 (2,3) by the OGA swings with amplitudes so small that it does not reach the boundaries.",
        Verdict.HOLDS if lasted and x_m < 1.2 and angle_deg < 18.0 else Verdict.DOES_NOT_HOLD,
        f"cart within {x_m:.2g} m, pole within {angle_deg:.2g} degrees for {champion.fitness:.0f} steps",
    )
    claims_table(page, [claim])
    return [claim]


def _draw_network(champion: Champion, path: Path) -> None:
    config = champion.config
    weights = config.controller.coding.decode(champion.genome, config.size)
    draw_network(weights, config.size, ["$x$", "$\\theta$"], ["force"], path)

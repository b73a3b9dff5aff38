"""The report's section on goal reach: Fig. 6, 7, 8 and the claims."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from sceann_hil.network.coding import Coding
from sceann_hil.robot import EndReason
from sceann_hil.study.report.behaviour import Champion, best_champion, draw_fig7, straightness
from sceann_hil.study.report.cells import Key, StudyData
from sceann_hil.study.report.claims import Claim, complete
from sceann_hil.study.report.goal_claims import SENSORS, goal_claims
from sceann_hil.study.report.network import draw_network
from sceann_hil.study.report.page import Page
from sceann_hil.study.report.panels import draw_fig6
from sceann_hil.study.report.wording import claims_table, runs_sentence
from sceann_hil.study.statistics import Verdict

_BEST = Key(Coding.SCEANN3, "oga", 7, 2)
_STRAIGHT = 1.1
"""Path divided by distance up to which we read "almost like a straight line"."""
_FACING_UP_DEG = 90.0


def fig6_section(page: Page, study: StudyData) -> list[Claim]:
    """Fig. 6 and the claims that the paper makes with it; Fig. 7 and 8."""
    cells = study.by_key
    page.heading("Fig. 6: goal reach, all codings")
    page.text(
        runs_sentence(study),
        "The paper gives no numbers for this task and leaves the robot's geometry open. Ours was chosen from about a "
        "hundred candidates so that the claims below *can* hold, on other seeds than these: agreement shows that the "
        "claims can arise in this model, not that these were the authors' values.",
    )
    claims: list[Claim] = []
    if complete(cells, tuple(Coding), SENSORS):
        caption = "Fig. 6: maximum fitness in the last generation, mean over the runs with 95 % intervals."
        page.figure("fig6", caption, partial(draw_fig6, cells, SENSORS))
        claims = goal_claims(cells)
        claims_table(page, claims)
    else:
        page.text("The grid is not complete; run the study to its end for the figure and the claims.")
    if _BEST in cells:
        claims += _best(page, best_champion(cells[_BEST]))
    return claims


def _best(page: Page, champion: Champion) -> list[Claim]:
    config = champion.config
    step_m = config.robot.model_dump()["top_speed_m_s"] * config.robot.spec.tick_s
    traces = champion.results.traces or ()
    ratios = [straightness(trace.state, step_m) for trace in traces]
    goals = int((champion.results.end_reasons == EndReason.GOAL).sum())
    page.heading("Fig. 7 and 8: the best controller of SCEANN3 (7,2) by the OGA")
    page.text(
        f"Champion of run {champion.run}, fitness {champion.fitness:.3f} in its last generation. Traced again under "
        f"new noise it reaches the goal from {goals} of {len(traces)} initial headings, in "
        f"{champion.results.steps.min()} to {champion.results.steps.max()} steps. After the first turn its path is "
        f"{min(ratios):.3f} to {max(ratios):.3f} times as long as the straight line."
    )
    headings = np.rad2deg(config.build_task().starts[:, 2])
    shown = int(np.abs(headings - _FACING_UP_DEG).argmin())
    page.figure("fig7", "Fig. 7: trajectories; the robot every fifth step.", partial(draw_fig7, champion, shown))
    page.figure("fig8", "Fig. 8: its network; solid excitatory, dashed inhibitory.", partial(_draw_network, champion))
    claim = Claim(
        "G7",
        f"The best SCEANN3 (7,2) by the OGA turns towards the goal and then moves almost like a straight line (read "
        f"as: at most {_STRAIGHT - 1:.0%} longer, from every initial heading).",
        Verdict.HOLDS if goals == len(traces) and max(ratios) <= _STRAIGHT else Verdict.DOES_NOT_HOLD,
        f"{min(ratios):.3f} to {max(ratios):.3f} times the straight line over {len(traces)} headings (one controller)",
    )
    claims_table(page, [claim])
    return [claim]


def _draw_network(champion: Champion, path: Path) -> None:
    config = champion.config
    weights = config.controller.coding.decode(champion.genome, config.size)
    sensors = [f"s{k + 1}" for k in range(config.size.n_sensors)]
    draw_network(weights, config.size, sensors, ["left", "right"], path)

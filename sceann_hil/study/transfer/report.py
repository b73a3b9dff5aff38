"""The conclusion of a transfer: in words, for programs, and as a page with figures in ``DIR/transfer``."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from sceann_hil.errors import requirement_of
from sceann_hil.run.transfer.state import Verdict
from sceann_hil.run.transfer.words import VERDICTS, expected
from sceann_hil.study.transfer.findings import Findings
from sceann_hil.versions import maker

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_LEARNT = 0.8
"""A quantity is listed whose deviation became smaller than so much of what it was."""


@dataclass(frozen=True, slots=True)
class Conclusion:
    """What there is to say at the end, or so far.

    Attributes:
        lines: for people.
        document: for programs.
    """

    lines: tuple[str, ...]
    document: dict[str, Any]


def conclude(directory: Path) -> Conclusion:
    """Look at a transfer and write its page: ``transfer/report.html``, ``transfer.json`` and ``robot.yaml``.

    Without matplotlib there is no page.

    Args:
        directory: of the run.

    Raises:
        NotARun: it is no transfer, or has no finished trial.
        OSError: the page cannot be written.
    """
    found = Findings.of(directory)
    folder = directory / "transfer"
    folder.mkdir(exist_ok=True)
    document = _document(found, folder)
    (folder / "transfer.json").write_text(json.dumps(document, indent=2), encoding="utf-8")
    robot = yaml.safe_dump({"robot": found.body}, sort_keys=False)
    (folder / "robot.yaml").write_text(
        "# The simulated robot that this one resembles most, as far as the trials tell.\n" + robot, encoding="utf-8"
    )
    lines = _lines(found, directory)
    try:
        _page(found, folder, directory, lines)
    except ModuleNotFoundError as missing:
        # a robot's host has no matplotlib, and a transfer is over without its page too
        install = f"pip install '{requirement_of(missing.name or '')}'"
        again = f"`sceann resume {shlex.quote(str(directory))}`"
        return Conclusion((*lines, f"No report was written: {install}, then {again} writes it."), document)
    return Conclusion((*lines, f"Report: {folder / 'report.html'}"), document)


def _lines(found: Findings, directory: Path) -> tuple[str, ...]:
    state, place = found.state, shlex.quote(str(directory))
    own = len(state.observed) - state.inherited
    lines = [
        f"After {own} trials on the robot"
        + (f" ({state.inherited} earlier ones count too)." if state.inherited else ".")
    ]
    if state.verdict is Verdict.OPEN:
        lines.append(f"Best so far: controller {found.genome}, expected fitness {expected(state.outlook)}.")
        lines.append(f"One more trial is expected to bring {state.outlook.gain:.2g}: `sceann resume {place}`.")
        return tuple(lines)
    lines[0] = lines[0].removesuffix(".") + f": {VERDICTS[state.verdict]}."
    if state.verdict is Verdict.NONE_SUCCEEDS:
        lines.append(
            f"No candidate is expected to succeed on this robot: the most promising one in at most "
            f"{state.outlook.most_success or 0.0:.0%} of its trials."
        )
        lines += _what_would_help(found, place)
        lines.append(f"The best of them, controller {found.genome}, has expected fitness {expected(state.outlook)}.")
    else:
        lines.append(f"Recommended: controller {found.genome}, expected fitness {expected(state.outlook)}.")
    if found.fresh is not None:
        between = found.fresh.interval
        told = f" ({between[0]:.3g} to {between[1]:.3g})" if between else ""
        success = "" if found.fresh.succeeded is None else f", {found.fresh.succeeded:.0%} of them succeeded"
        lines.append(f"Measured on {len(found.fresh.values)} fresh trials: {found.fresh.mean:.3g}{told}{success}.")
    target = getattr(found.config.algorithm, "target", None)
    if target is not None and state.outlook.fitness < target:
        lines.append(f"The wanted fitness {target:.4g} is not expected of any candidate.")
        lines += _what_would_help(found, place)
    return tuple(lines)


def _what_would_help(found: Findings, place: str) -> list[str]:
    if found.best_success == 0.0:
        return [
            "In simulation no candidate succeeded in any of the drawn robots either. What would help: another "
            "controller (n_hidden, neuron, more sensors), a robot that differs less, or better candidates (--from)."
        ]
    return [
        "What would help: evolve new candidates in the simulated robots that it resembles, and go on: "
        f"`sceann transfer ROBOT.yaml --again {place} --out DIR`."
    ]


def _document(found: Findings, folder: Path) -> dict[str, Any]:
    state = found.state
    low, high = state.outlook.interval
    fresh = None
    if found.fresh is not None:
        fresh = {
            "trials": len(found.fresh.values),
            "fitness": found.fresh.mean,
            "interval": found.fresh.interval,
            "success": found.fresh.succeeded,
        }
    return {
        "verdict": state.verdict.value,
        "trials": len(state.observed) - state.inherited,
        "earlier_trials": state.inherited,
        "recommended": found.genome,
        "expected": {"fitness": state.outlook.fitness, "interval": [low, high], "success": state.outlook.success},
        "one_more_trial_brings": state.outlook.gain,
        "measured": fresh,
        "robots_alike": {
            str(number): float(found.weights[number]) for number in (-found.weights).argsort(kind="stable")[:5].tolist()
        },
        "quantities": {
            name: {
                "before": found.before[:, place].tolist(),
                "after": found.after[:, place].tolist(),
            }
            for place, name in enumerate(found.robots.names)
        },
        "folder": str(folder),
    }


def _saved(figure: Figure) -> Callable[[Path], None]:
    def draw(path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        for suffix, key in ((".svg", "Creator"), (".png", "Software")):
            figure.savefig(path.with_suffix(suffix), dpi=110, metadata={key: maker()})

    return draw


def _page(found: Findings, folder: Path, directory: Path, lines: tuple[str, ...]) -> None:
    # these need matplotlib, which is not on a robot's host
    from sceann_hil.study.report.page import Page
    from sceann_hil.study.transfer import figures

    place = shlex.quote(str(directory))
    page = Page(f"Transfer {directory.name}", folder, "report")
    page.text(*lines)
    page.heading("Expected and measured")
    page.figure(
        "progress", "Expected fitness of the best candidate before each trial.", _saved(figures.progress(found))
    )
    page.heading("Which simulated robots it resembles")
    page.figure(
        "resemblance",
        "Likelihood of the trials in each simulated robot: the posterior over the ensemble, and its heaviest members.",
        _saved(figures.resemblance(found)),
    )
    page.heading("The gap that follows")
    page.text(
        "What the trials say of every quantity that was drawn. The file `robot.yaml` beside this page is a simulated "
        "robot with the means."
    )
    page.figure("gap", "Mean and standard deviation before and after the trials.", _saved(figures.gap(found)))
    learnt = [p for p in range(len(found.robots.names)) if found.after[1, p] < _LEARNT * found.before[1, p]]
    rows = [
        [
            found.robots.names[p],
            f"{found.before[0, p]:.3g} ± {found.before[1, p]:.2g}",
            f"{found.after[0, p]:.3g} ± {found.after[1, p]:.2g}",
        ]
        for p in learnt
    ]
    if rows:
        page.table(["quantity", "before", "after"], rows)
    else:
        page.text("No quantity is known much better than before: the trials tell controllers apart, not causes.")
    page.heading("Look further")
    page.code(
        [f"sceann view {place}", f"sceann export {place}", f"sceann compare {place} --on {place}/transfer/robot.yaml"]
    )
    page.write()

"""Figures of a transfer: how the expectation grew, which robots this one resembles, and the gap that follows."""

from __future__ import annotations

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot
from matplotlib.figure import Figure

from sceann_hil.study.transfer.findings import Findings

_BLUE, _ORANGE, _GREY = "#0072b2", "#e69f00", "#777777"
MOST_ROBOTS = 12


def progress(found: Findings) -> Figure:
    """Expected best fitness with its interval before each trial, what each trial brought, and the fresh measurement."""
    figure, (upper, lower) = pyplot.subplots(
        2, figsize=(8, 5.5), sharex=True, height_ratios=(3, 1), layout="constrained"
    )
    number = np.array([told["trials"] for told in found.history])
    expected = np.array([told["expected"] for told in found.history])
    low, high = np.array([told["interval"] for told in found.history]).T
    upper.fill_between(number, low, high, color=_BLUE, alpha=0.2, linewidth=0, label="95 % of it")
    upper.plot(number, expected, color=_BLUE, label="expected fitness of the best candidate")
    measured = [(told["trials"] + 1, told["fitness"]) for told in found.history if told["fitness"] is not None]
    if measured:
        upper.plot(*zip(*measured, strict=True), "o", color=_ORANGE, markersize=4, label="one trial")
    if found.fresh is not None:
        at = number[-1] + 1.5
        upper.plot([at], [found.fresh.mean], "D", color="black", label="recommended, fresh trials")
        if found.fresh.interval is not None:
            upper.vlines(at, *found.fresh.interval, color="black")
    upper.set_ylabel("fitness")
    upper.legend(frameon=False, fontsize=8)
    lower.plot(number, [told["gain"] for told in found.history], color=_BLUE)
    lower.set_ylabel("what one more\ntrial brings")
    lower.set_xlabel("trials on the robot")
    lower.set_ylim(bottom=0.0)
    return figure


def resemblance(found: Findings) -> Figure:
    """The posterior over the ensemble: all simulated robots added up, and those that this one resembles most."""
    ranked = np.argsort(-found.weights, kind="stable")
    order, n = ranked[:MOST_ROBOTS], len(ranked)
    figure, (left, axes) = pyplot.subplots(1, 2, figsize=(8, 3), width_ratios=(2, 3), layout="constrained")
    number = np.arange(n + 1)
    left.plot(number, np.concatenate([[0.0], found.weights[ranked].cumsum()]), color=_BLUE, label="after the trials")
    left.plot(number, number / n, color=_GREY, linewidth=0.8, label="before any trial")
    left.set_xlabel("simulated robots, most alike first")
    left.set_ylabel("likeness of so many together")
    left.legend(frameon=False, fontsize=8)
    axes.bar(range(len(order)), found.weights[order], color=_BLUE)
    axes.axhline(1.0 / n, color=_GREY, linewidth=0.8, label="before any trial")
    axes.set_xticks(range(len(order)), [f"robot {number}" for number in order.tolist()], rotation=45, ha="right")
    axes.set_ylabel("likeness")
    axes.legend(frameon=False, fontsize=8)
    return figure


def gap(found: Findings) -> Figure:
    """Every drawn quantity before and after the trials, in units of its spread before."""
    names = found.robots.names
    figure, axes = pyplot.subplots(figsize=(8, 1.2 + 0.24 * len(names)), layout="constrained")
    scale = np.where(found.before[1] > 0.0, found.before[1], 1.0)
    shift = (found.after[0] - found.before[0]) / scale
    place = np.arange(len(names))[::-1]
    axes.hlines(place, -1.0, 1.0, color=_GREY, alpha=0.35, linewidth=7, label="before: mean and deviation")
    axes.errorbar(
        shift, place, xerr=found.after[1] / scale, fmt="o", color=_BLUE, markersize=4, label="after the trials"
    )
    axes.set_yticks(place, names, fontsize=8)
    axes.set_xlabel("deviations from what was expected before")
    axes.legend(frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2)
    return figure

"""What the open choices matter: each variant against the default, which is the first value of its axis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.study.condition import setting_text
from sceann_hil.study.report.cells import Cell, StudyData
from sceann_hil.study.report.more_figures import ForestRow, draw_forest
from sceann_hil.study.report.page import Page
from sceann_hil.study.report.wording import runs_sentence
from sceann_hil.study.statistics import Interval, contrast, strict_level

PREFIX = "sensitivity-"
_LONG = 45
_SPLIT = "algorithm.type"
"""An axis that gives rows of its own instead of being averaged over."""


@dataclass(frozen=True)
class Variant:
    """One value of the axis under study.

    Attributes:
        name: for people.
        interval: mean over the other axes, in displayed units.
        reference: the same of the default of its group.
        difference: to the default of the same group; None for the default itself.
        matters: the difference is significant, at a level corrected for the number of variants.
    """

    name: str
    interval: Interval
    reference: Interval
    difference: Interval | None
    matters: bool


def sensitivity_section(page: Page, study: StudyData) -> None:
    """One study in which one axis is varied; the first axis of the grid whose name is not an algorithm's type."""
    page.heading(f"Sensitivity: {study.name.removeprefix(PREFIX)}", 3)
    page.text(study.about, runs_sentence(study))
    variants = variants_of(study)
    if study.missing or not variants:
        page.text("The study is not complete; run it to its end for a comparison.")
        return
    unit = "success rate (%)" if _is_success(study) else "mean best fitness (x 100)"
    caption = (
        f"{study.name}: {unit}, mean over the other axes, with 95 % intervals. Black: the default, and its interval as "
        "a band; orange: differs from it significantly (after Bonferroni's correction)."
    )
    rows = [ForestRow(_in_lines(v.name), v.interval, v.reference, v.matters) for v in variants]
    page.figure(study.name, caption, partial(draw_forest, rows, unit))
    telling = [variant for variant in variants if variant.matters]
    if telling:
        page.text("What matters, as difference to the default:")
        page.bullets([f"{variant.name}: {_shown(variant.difference)}" for variant in telling])
    else:
        page.text("No variant differs significantly from the default (after Bonferroni's correction).")


def variants_of(study: StudyData) -> list[Variant]:
    """Every variant of a study, the default first in its group; empty if a cell has fewer than two runs."""
    if not study.cells or any(cell.n < 2 for cell in study.cells):
        return []
    axis = _axis(study)
    groups: dict[str, dict[str, list[int]]] = {}
    common = _common_items(study, axis)
    for index, cell in enumerate(study.cells):
        settings = dict(cell.condition.settings)
        group = str(settings.get(_SPLIT, "")) if axis != _SPLIT else ""
        groups.setdefault(group, {}).setdefault(_variant_text(axis, settings[axis], common), []).append(index)
    samples = {index: _values(study, cell) for index, cell in enumerate(study.cells)}
    n_comparisons = sum(len(variants) - 1 for variants in groups.values())
    return [
        variant
        for group, variants in groups.items()
        for variant in _compared(group, variants, samples, strict_level(n_comparisons))
    ]


def _compared(
    group: str, variants: Mapping[str, Sequence[int]], samples: Mapping[int, NDArray[np.float64]], level: float
) -> list[Variant]:
    default = next(iter(variants.values()))
    reference = contrast(samples, _mean_of(default))
    found = []
    for name, members in variants.items():
        shown = f"{group.upper()}, {name}" if group else name
        interval = contrast(samples, _mean_of(members))
        if members is default:
            found.append(Variant(_default_text(shown), interval, reference, None, False))
            continue
        weights = _minus(members, default)
        strict = contrast(samples, weights, level)
        found.append(Variant(shown, interval, reference, contrast(samples, weights), not strict.contains_zero))
    return found


def _mean_of(members: Sequence[int]) -> dict[int, float]:
    """Weights of a mean over cells."""
    return {index: 1.0 / len(members) for index in members}


def _minus(members: Sequence[int], default: Sequence[int]) -> dict[int, float]:
    """Weights of a difference of two such means."""
    weights = _mean_of(members)
    for index, weight in _mean_of(default).items():
        weights[index] = weights.get(index, 0.0) - weight
    return weights


def _axis(study: StudyData) -> str:
    axes = [axis for axis, _ in study.cells[0].condition.settings]
    return next((axis for axis in axes if axis != _SPLIT), axes[0])


def _common_items(study: StudyData, axis: str) -> set[tuple[str, str]]:
    """What every section on an axis has in common; nothing if the axis has plain values."""
    sections = [value for cell in study.cells for key, value in cell.condition.settings if key == axis]
    items = [{(str(k), str(v)) for k, v in section.items()} for section in sections if isinstance(section, dict)]
    return set.intersection(*items) if items else set()


def _variant_text(axis: str, value: Any, common: set[tuple[str, str]]) -> str:
    if not isinstance(value, dict):
        return setting_text(axis, value)
    special = {key: inner for key, inner in value.items() if (str(key), str(inner)) not in common}
    kind = str(special.pop("type", ""))
    rest = ", ".join(f"{key}={inner}" for key, inner in special.items())
    return f"{kind.upper()} {rest}".strip()


def _default_text(shown: str) -> str:
    shown = shown.removesuffix(", ")
    return f"{shown} (default)" if shown else "default"


def _in_lines(name: str) -> str:
    """A long name on two lines."""
    return name.replace(", ", ",\n") if len(name) > _LONG else name


def _is_success(study: StudyData) -> bool:
    return study.cells[0].condition.config.task.type == "pole_balancing"


def _values(study: StudyData, cell: Cell) -> NDArray[np.float64]:
    return 100.0 * (cell.succeeded.astype(np.float64) if _is_success(study) else cell.fitness)


def _shown(difference: Interval | None) -> str:
    if difference is None:
        return ""
    return f"{difference.estimate:+.1f} [{difference.low:+.1f}, {difference.high:+.1f}]"

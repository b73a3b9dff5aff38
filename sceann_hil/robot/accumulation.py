"""What the values of a trial's steps add up to, from the steps that a robot told of.

The simulation adds up while it runs (`backends.simulation.lanes`); here the same functions run over a trace, in the
same order, so both give the same bits.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from enum import StrEnum
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.errors import PluginError
from sceann_hil.network.compiled import bound, compiled, compiled_part
from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.robot.end_reasons import EndReason
from sceann_hil.robot.step_value import Floats, StepValue, shown
from sceann_hil.robot.trials import Results, Trace, Trials


class Combine(StrEnum):
    """What a trial's steps add up to."""

    MEAN = "mean"
    """Their sum, divided by the number of steps that the trial lasted."""
    MEAN_OF_ALL = "mean_of_all"
    """Their sum, divided by the number of steps that a trial may last: what ended early gets nothing for the rest."""
    SUM = "sum"
    MIN = "min"
    MAX = "max"
    LAST = "last"


_CODES = {Combine.MEAN: 0, Combine.MEAN_OF_ALL: 0, Combine.SUM: 0, Combine.MIN: 1, Combine.MAX: 2, Combine.LAST: 3}
_FIRST = (0.0, np.inf, -np.inf, 0.0)


@compiled_part
def combined(total: float, value: float, rule: int) -> float:
    """A trial's total after one more step; what is no number stays in it."""
    if rule == 0:
        return total + value
    if rule == 1:
        return value if value < total or value != value else total
    if rule == 2:
        return value if value > total or value != value else total
    return value


class Accumulation:
    """A step value, and what a trial's values add up to.

    Attributes:
        value: of one step.
        combine: of all steps.
        max_steps: that a trial may last.
        rule: number of `combine` for compiled code; see `combined`.
        first: the total before the first step.
    """

    def __init__(self, value: StepValue, combine: Combine, max_steps: int) -> None:
        self.value = value
        self.combine = combine
        self.max_steps = max_steps
        self.rule = _CODES[combine]
        self.first = _FIRST[self.rule]

    def worth(self, totals: Floats, steps: NDArray[np.int32]) -> Floats:
        """What trials are worth, from their totals and numbers of steps, shape ``(n,)``."""
        if self.combine is Combine.MEAN:
            return np.asarray(totals / np.maximum(steps, 1))
        return np.asarray(totals / self.max_steps if self.combine is Combine.MEAN_OF_ALL else totals)

    def of_steps(self, trace: Trace, n_motors: int) -> Floats:
        """The value of each step of a trial, shape ``(n,)``; `n_motors` of the network's neurons are motors."""
        values = np.zeros(len(trace.sensors))
        try:
            self._trace_values(*_seen(trace, n_motors), values)
        except IndexError as error:
            raise self.value.reached_too_far(error) from error
        return values

    def so_far(self, values: Floats) -> Floats:
        """What a trial would be worth if it ended after each of its steps, shape ``(n,)``."""
        totals = np.zeros(len(values))
        _totals(values, self.first, self.rule, totals)
        return self.worth(totals, np.arange(1, len(values) + 1, dtype=np.int32))

    def total(self, values: Floats) -> float:
        """What the values of a trial's steps, at least one, add up to in their order."""
        totals = np.zeros(len(values))
        _totals(values, self.first, self.rule, totals)
        return float(totals[-1])

    def complete(self, trials: Trials, results: Results) -> Results:
        """Results with their totals; a robot that tells its steps need not know of them.

        A trial of which not every step is known becomes void.

        Raises:
            PluginError: a step was worth no number.
        """
        if results.values is None:
            results = self._from_traces(trials, results)
        values = np.zeros(0) if results.values is None else results.values
        for place in np.flatnonzero(results.counts & ~np.isfinite(values))[:1].tolist():
            raise PluginError(
                f"{self.value}: the steps of trial {trials.ids[place]} add up to {values[place]}"
                + self._where(results.traces[place] if results.traces else None, trials.size.n_motors)
                + ".",
                "No fitness is made of it. Say in the function what such a step is worth.",
            )
        return results

    def _from_traces(self, trials: Trials, results: Results) -> Results:
        totals = np.full(len(results), np.nan)
        ends = results.end_reasons.copy()
        for i in np.flatnonzero(results.counts).tolist():
            trace = results.traces[i] if results.traces is not None else None
            if trace is None or not len(trace.sensors) == results.steps[i] > 0 or not self._knows(trace):
                ends[i] = EndReason.LINK_LOST
            else:
                totals[i] = self.total(self.of_steps(trace, trials.size.n_motors))
        lost = bool((ends != results.end_reasons).any())
        why = results.why_void or ("not every step of the trial is known" if lost else "")
        return replace(results, values=totals, end_reasons=ends, why_void=why)

    def _knows(self, trace: Trace) -> bool:
        return not self.value.uses_state or (trace.state.shape[1] > 0 and bool(np.isfinite(trace.state).all()))

    def _where(self, trace: Trace | None, n_motors: int) -> str:
        if trace is None:
            return ""
        values = self.of_steps(trace, n_motors)
        step = int(np.argmax(~np.isfinite(values)))
        sensors, motors, _ = _seen(trace, n_motors)
        told = f"sensors {shown(sensors[step])}, motors {shown(motors[step])}"
        return f"; step {step} is worth {values[step]} with {told}"

    @cached_property
    def _trace_values(self) -> Callable[[Floats, Floats, Floats, Floats], None]:
        return bound(_trace_values, value=self.value.part)


value: Any = None
"""A `StepValue.part`, in the globals that `bound` makes."""


def _trace_values(sensors: Floats, motors: Floats, states: Floats, values: Floats) -> None:
    for step in range(values.shape[0]):
        values[step] = value(sensors[step], motors[step], states[step])


@compiled
def _totals(values: Floats, first: float, rule: int, totals: Floats) -> None:
    total = first
    for step in range(values.shape[0]):
        total = combined(total, values[step], rule)
        totals[step] = total


def _seen(trace: Trace, n_motors: int) -> tuple[Floats, Floats, Floats]:
    """Sensors, motors and states of each step, as a value's function gets them."""
    sensors, motors = trace.sensors / float(SENSOR_MAX), trace.x[:, -n_motors:] / float(ONE)
    return sensors, motors, trace.state[: len(sensors)].astype(np.float64)

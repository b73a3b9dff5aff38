"""One trial that was run in simulation or measured on a robot: what happened, step by step, by name."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from sceann_hil.api.frames import pandas_module
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.robot import EndReason, Results, Trace

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """One trial.

    Attributes:
        number: which of the task's trials it was, from 0.
        start: its start values by name.
        fitness: what it was worth.
        succeeded: it reached what the task asks for.
        end_reason: why it ended.
        steps: control steps done.
        tick_s: length of one of them.
        size: of the network.
        state_fields: names, with units, of the body's state.
        trace: every step of it, as integers.
    """

    number: int
    start: dict[str, float]
    fitness: float
    succeeded: bool
    end_reason: EndReason
    steps: int
    tick_s: float
    size: NetworkSize = field(repr=False)
    state_fields: tuple[str, ...] = field(repr=False)
    trace: Trace = field(repr=False)

    def frame(self) -> pandas.DataFrame:
        """Everything over time, one row per step and one for where it ended.

        The index is the step. ``time_s``; the body's state before the step, by the names of its fields; sensors
        ``s1, s2, ...``, outputs of hidden neurons ``h1, ...`` and motors ``m1, ...`` as fractions 0..1; their states
        ``u_h1, ..., u_m1, ...``. In the last row only the state is known.

        Raises:
            PackageMissing: pandas is not installed; `trace` does without.
        """
        trace, n = self.trace, len(self.trace.sensors)
        rows = n + 1 if trace.state.shape[1] else n
        columns: dict[str, NDArray[Any]] = {"time_s": np.arange(rows) * self.tick_s}
        columns |= {name: trace.state[:rows, i].astype(np.float64) for i, name in enumerate(self.state_fields)}
        for names, values in (
            (self.size.sensor_names, trace.sensors / SENSOR_MAX),
            (self.size.neuron_names, trace.x / ONE),
            (tuple(f"u_{name}" for name in self.size.neuron_names), trace.u / ONE),
        ):
            padded = np.full((rows, len(names)), np.nan)
            padded[:n] = values
            columns |= {name: padded[:, i] for i, name in enumerate(names)}
        frame: pandas.DataFrame = pandas_module().DataFrame(columns)
        frame.index.name = "step"
        return frame

    def _repr_html_(self) -> str:
        return f"<code>{self!r}</code>"


def trials_of(
    results: Results,
    fitness: NDArray[np.float64],
    succeeded: NDArray[np.bool_],
    numbers: NDArray[np.int64],
    starts: list[dict[str, float]],
    tick_s: float,
    size: NetworkSize,
    state_fields: tuple[str, ...],
) -> list[Trial]:
    """Results with traces as trials; arrays of shape ``(n,)``, `starts` as long."""
    traces = results.traces or []
    return [
        Trial(
            number=int(numbers[i]),
            start=starts[i],
            fitness=float(fitness[i]),
            succeeded=bool(succeeded[i]),
            end_reason=EndReason(results.end_reasons[i]),
            steps=int(results.steps[i]),
            tick_s=tick_s,
            size=size,
            state_fields=state_fields if trace.state.shape[1] else (),
            trace=trace,
        )
        for i, trace in enumerate(traces)
    ]

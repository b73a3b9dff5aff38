"""Batches of trials through the lane engine, on all cores: what every simulated robot does in `Robot.run`."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from backends.simulation.adding_up import accumulating, nothing
from backends.simulation.body import SimulatedBody
from backends.simulation.gap import Gap
from backends.simulation.lanes import run_lanes
from backends.simulation.stepwise import StepwiseBody
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Neuron
from sceann_hil.network.neurons import LANES
from sceann_hil.robot import GapEstimate, Results, Trace, Trials
from sceann_hil.robot.accumulation import Accumulation

_SMALLEST_SHARE = LANES
_SHARES_PER_THREAD = 4


class SimulatedRobot(SimulatedBody):
    """A `SimulatedBody` that runs trials.

    A subclass gives the `spec` and the body. The same `Trials` give the same bits alone, in any batch and on any
    number of threads.

    Args:
        gap: the body's imperfections.
        threads: how many cores to use; None for all.
    """

    def __init__(self, gap: Gap = Gap(), threads: int | None = None) -> None:  # noqa: B008
        super().__init__(gap)
        self._threads = threads or os.cpu_count() or 1
        self._loops: dict[Accumulation | None, Callable[..., None]] = {}

    def use_cores(self, count: int) -> None:
        """Compute on at most `count` cores."""
        self._threads = count

    def connect(self) -> None:
        """Load or make the machine code, so that the first trial does not wait for it."""
        size = NetworkSize(self.spec.n_sensors, 1, self.spec.n_motors)
        self.run(Trials.none(size, len(self.spec.start_fields)))

    def run(self, trials: Trials) -> Results:
        """Run the trials; no traces. Shapes as in `Results`."""
        return self._simulate(trials, tracing=False)

    def trace(self, trials: Trials) -> Results:
        """Run the trials and keep everything about them: memory grows with ``len(trials) * max_steps``."""
        return self._simulate(trials, tracing=True)

    def estimate_gap(self, starts: NDArray[np.float64], traces: Sequence[Trace]) -> GapEstimate:
        """See `backends.simulation.estimate`."""
        from backends.simulation.estimate import estimate_gap  # SciPy comes with it, and no run needs it

        return estimate_gap(self, starts, tuple(traces))

    def stepwise(self) -> StepwiseBody:
        """The same body, moved one tick at a time from outside."""
        return StepwiseBody(self)

    def _loop(self, accumulation: Accumulation | None) -> Callable[..., None]:
        if accumulation not in self._loops:
            part = nothing if accumulation is None else accumulating(accumulation, self.spec)
            self._loops[accumulation] = self.bind(run_lanes, accumulate=part)
        return self._loops[accumulation]

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(self._threads, thread_name_prefix="lanes")

    def _simulate(self, trials: Trials, *, tracing: bool) -> Results:
        spec, size = self.spec, trials.size
        size.check_fits(spec.n_sensors, spec.n_motors, spec.name)
        n, n_state = len(trials), len(spec.state_fields)
        rows = n if tracing else 0
        end_reasons = np.empty(n, np.uint8)
        steps = np.empty(n, np.int32)
        hashes = np.empty(n, np.uint16)
        final_states = np.empty((n, n_state), np.float32)
        trace_state = np.empty((rows, trials.max_steps + 1, n_state), np.float32)
        trace_sensors = np.empty((rows, trials.max_steps, size.n_sensors), np.uint16)
        trace_u = np.empty((rows, trials.max_steps, size.n_neurons), np.int16)
        trace_x = np.empty((rows, trials.max_steps, size.n_neurons), np.int16)
        states, parameters = self.checked_states(trials.starts, trials.keys), self.checked_parameters()
        gap = self.gap.draw(trials.keys, size.n_sensors, size.n_motors, self.neutral_motor)

        accumulation, loop = trials.accumulation, self._loop(trials.accumulation)
        totals = np.empty(n)
        first_total = 0.0 if accumulation is None else accumulation.first

        def simulate(part: slice) -> None:
            traced = part if tracing else slice(0, 0)
            loop(
                trials.weights,
                trials.genome_index[part],
                states[part],
                trials.keys[part],
                trials.max_steps,
                size.n_hidden,
                trials.dynamics.neuron is Neuron.MEMORYLESS,
                trials.dynamics.initial_output,
                *self.noise_rows,
                gap[part] if len(gap) else gap,
                parameters,
                end_reasons[part],
                steps[part],
                hashes[part],
                final_states[part],
                trace_state[traced],
                trace_sensors[traced],
                trace_u[traced],
                trace_x[traced],
                first_total,
                totals[part],
            )

        def simulate_all() -> None:
            if len(parts) < 2 or self._threads == 1:
                simulate(slice(0, n))
            else:
                list(self._pool.map(simulate, parts))

        share = max(_SMALLEST_SHARE, -(-n // (self._threads * _SHARES_PER_THREAD)))
        parts = [slice(first, min(first + share, n)) for first in range(0, n, share)]
        try:
            simulate_all()
        except IndexError as error:
            if accumulation is None:
                raise
            raise accumulation.value.reached_too_far(error) from error
        traces = None
        if tracing:
            traces = [
                Trace(trace_state[i, : k + 1], trace_sensors[i, :k], trace_u[i, :k], trace_x[i, :k])
                for i, k in enumerate(steps)
            ]
        durations_s = steps.astype(np.float64) * spec.tick_s
        values = None if accumulation is None else totals
        results = Results(end_reasons, steps, hashes, final_states, durations_s, traces, values=values)
        if accumulation is not None and not tracing:
            for bad in np.flatnonzero(~np.isfinite(totals))[:1].tolist():
                # once more with every step, to tell which one it was
                self.trace(trials.take(slice(bad, bad + 1)))
        return trials.completed(results)

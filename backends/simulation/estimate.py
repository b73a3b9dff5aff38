"""Which gap makes a simulated body behave like a real robot: estimated from the robot's own traces.

The robot's motor values are known exactly (its network can be computed from its sensors), so the body is driven with
them, open loop, from the trial's start: delayed by the latency, scaled by the motor gain. The sensors that it would
have had are held against those that the robot had; what is left on average is each sensor's offset. Latency and gain
are the ones with the least squares. Only the first steps of a trial are used: later on an unstable body has forgotten
its start.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from backends.simulation.body import SimulatedBody
from backends.simulation.stepwise import StepwiseBody
from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.robot import GapEstimate, Trace

WINDOW_STEPS = 40
MOST_TRIALS = 12
LATENCIES = range(7)
GAINS = (0.3, 1.7)


def estimate_gap(robot: SimulatedBody, starts: NDArray[np.float64], traces: tuple[Trace, ...]) -> GapEstimate:
    """The estimate.

    Args:
        robot: the simulated body, without a gap of its own.
        starts: start values of each trace's trial, shape ``(n, n_start)``.
        traces: of the robot.
    """
    from scipy.optimize import minimize_scalar  # half a second to import, and a body is used without it

    body = StepwiseBody(robot)
    used = [(start, trace) for start, trace in zip(starts, traces, strict=True) if len(trace.sensors) > 2]
    # the longest ones say most; a trial that ended at once says nothing of latency
    used = sorted(used, key=lambda pair: -len(pair[1].sensors))[:MOST_TRIALS]
    if not used:
        raise ValueError("traces: expected at least one of more than 2 steps")
    best: tuple[float, float, int] | None = None
    for latency in LATENCIES:
        found = minimize_scalar(
            lambda gain, latency=latency: _misfit(body, used, gain, latency)[0],
            bounds=GAINS,
            method="bounded",
            options={"xatol": 2e-3},
        )
        if best is None or found.fun < best[0]:
            best = (float(found.fun), float(found.x), latency)
    _, gain, latency = best if best is not None else (0.0, 1.0, 0)
    mean_square, offsets = _misfit(body, used, gain, latency)
    return GapEstimate(
        sensor_offset=tuple(round(float(offset), 4) for offset in offsets),
        motor_gain=round(gain, 3),
        latency_steps=latency,
        residual=float(np.sqrt(mean_square)),
    )


def _misfit(
    body: StepwiseBody, used: list[tuple[NDArray[np.float64], Trace]], gain: float, latency: int
) -> tuple[float, NDArray[np.float64]]:
    """Mean square of what is left of the sensors without their offsets (full scale 1), and the offsets."""
    neutral = body.robot.neutral_motor * ONE
    n_motors = body.robot.spec.n_motors
    differences = []
    for start, trace in used:
        steps = min(WINDOW_STEPS, len(trace.sensors))
        body.reset(start, np.uint64(0))
        motors = trace.x[:steps, -n_motors:].astype(np.float64)
        difference = np.full((steps, trace.sensors.shape[1]), np.nan)
        for step in range(steps):
            expected = body.sense().astype(np.int32)
            measured = trace.sensors[step].astype(np.int32)
            inside = (expected > 0) & (expected < SENSOR_MAX) & (measured > 0) & (measured < SENSOR_MAX)
            difference[step, inside] = (measured - expected)[inside] / SENSOR_MAX
            then = motors[step - latency] if step >= latency else np.full(n_motors, neutral)
            if body.move((neutral + gain * (then - neutral)).tolist()) is not None:
                break
        differences.append(difference)
    everything = np.concatenate(differences)
    known = ~np.isnan(everything)
    count = known.sum(axis=0)
    offsets = np.where(known, everything, 0.0).sum(axis=0) / np.maximum(count, 1)
    left = np.where(known, everything - offsets, 0.0)
    return float((left**2).sum() / max(int(known.sum()), 1)), offsets

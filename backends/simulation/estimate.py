"""Which gap makes a simulated body behave like a real robot: estimated from the robot's own traces.

Least squares between what the robot's sensors read and what `backends.simulation.gap_model` expects, over all samples
of the first steps of every trial, for every latency. Intervals come from the trials as they differ from each other: a
jackknife over whole trials (Quenouille 1956, Tukey 1958), with one Gauss-Newton step for each trial left out. They hold
for errors that are correlated within a trial, such as wheels that slip, and say nothing of what no gap can describe.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from backends.simulation.body import SimulatedBody
from backends.simulation.gap_fit import WIRE, Fit, fitted, noise_of_each, prior_precisions
from backends.simulation.gap_model import Float, GapModel, Observed, Parameters
from sceann_hil.robot import NOT_IDENTIFIABLE, Estimated, GapEstimate, Trace

LEVEL = 0.95
FEWEST_TRIALS = 3
"""Fewer different trials give no interval."""
FEWEST_SAMPLES = 20
"""Fewer samples in range say nothing of a sensor."""
WIDEST = {"sensor_offset": 0.1, "sensor_gain": 0.3, "motor_gain": 0.3, "latency_steps": 2.0}
"""Half widths of intervals beyond which the trials do not tell a quantity."""
_ROUNDING = 0.5 * WIRE
"""Sensors are rounded to wire values; the same rounding in every trial hides in no interval over trials."""
_GAIN_ROUNDING = 0.002
_OWN_NOISE = 2.2
"""Intervals are so much wider for a body with noise of its own, whose expected path is a mean of few copies. It was
chosen for intervals that hold the truth in 95 % of drawn robots (diffdrive with its motion noise)."""


def estimate_gap(robot: SimulatedBody, starts: NDArray[np.float64], traces: tuple[Trace, ...]) -> GapEstimate:
    """The estimate.

    Args:
        robot: the simulated body; its own gap is left out.
        starts: start values of each trace's trial, shape ``(n, n_start)``.
        traces: of the robot.

    Raises:
        ValueError: there is no trace of more than 2 steps.
    """
    observed = Observed.of(starts, traces, robot.spec.n_motors)
    model = GapModel(robot, observed)
    fits, weights, noise = fitted(model)
    best = min(fits, key=lambda fit: fit.misfit)
    expected = model.expected(best.parameters, noise).mean(axis=1)
    overlap = (observed.in_range & (expected > 0.0) & (expected < 1.0)).sum(axis=(0, 1))
    half = _half_widths(model, best, weights, noise)
    n, found = robot.spec.n_sensors, best.parameters
    enough = overlap >= FEWEST_SAMPLES
    moved = np.full(robot.spec.n_motors, enough.any())
    without = model.residual(Parameters.none(n, robot.spec.n_motors), 0.0)
    samples = max(1, int(observed.known.sum()) * n)
    return GapEstimate(
        sensor_offset=_each(found.offset, half[:n], WIDEST["sensor_offset"], enough),
        sensor_gain=_each(found.gain, half[n : 2 * n], WIDEST["sensor_gain"], enough),
        sensor_noise=_noise_of(model, found),
        motor_gain=_each(found.motor_gain, half[2 * n :], WIDEST["motor_gain"], moved),
        latency_steps=_latency(fits, weights, noisy=model.copies > 1) if enough.any() else NOT_IDENTIFIABLE,
        residual=float(np.sqrt((best.residual**2).sum() / samples)),
        residual_without=float(np.sqrt((without**2).sum() / samples)),
        trials=len(observed.starts),
        overlap=tuple(overlap.tolist()),
    )


def _half_widths(model: GapModel, fit: Fit, weights: Float, noise: float) -> Float:
    """Half of each parameter's interval, in the order of `Parameters.vector`; infinite with too few trials."""
    spec, n = model.robot.spec, len(model.observed.starts)
    if n < FEWEST_TRIALS:
        return np.full(len(fit.parameters.vector), np.inf)
    jacobian = model.jacobian(fit.parameters, noise)
    squares = np.einsum("tsjk,tsjl,tsj->tkl", jacobian, jacobian, weights)
    slopes = np.einsum("tsjk,tsj,tsj->tk", jacobian, weights, fit.residual)
    prior = np.diag(prior_precisions(spec.n_sensors, spec.n_motors))
    whole = squares.sum(axis=0) + prior
    left_out = np.stack([np.linalg.solve(whole - one, slope) for one, slope in zip(squares, slopes, strict=True)])
    left_out -= left_out.mean(axis=0)
    inverse = np.linalg.inv(whole)
    variance = (n - 1) / n * (left_out**2).sum(axis=0) + np.diag(inverse @ prior @ inverse)
    reach = float(stats.t.ppf(0.5 + LEVEL / 2.0, n - 1)) * (_OWN_NOISE if model.copies > 1 else 1.0)
    rounding = np.full(len(variance), _GAIN_ROUNDING)
    rounding[: spec.n_sensors] = _ROUNDING
    return np.asarray(reach * np.sqrt(variance) + rounding)


def _latency(fits: list[Fit], weights: Float, *, noisy: bool) -> Estimated:
    """The best latency and the range of those that the trials do not exclude.

    Excluded is what fits worse in nearly all trials (a paired t test), or so much worse in all together that one
    independent observation for each trial would do (an F test). Of a body with noise of its own, whose trials differ
    for other reasons too, only what both tests exclude.
    """
    n = len(fits[0].residual)
    if n < FEWEST_TRIALS:
        return NOT_IDENTIFIABLE
    squares = {fit.parameters.latency: (weights * fit.residual**2).sum(axis=(1, 2)) for fit in fits}
    best = min(fits, key=lambda fit: fit.misfit).parameters.latency
    # Kish's effective number: if few trials are ill fitted, there are only as many observations of how ill
    observations = max(2.0, float(squares[best].sum() ** 2 / (squares[best] ** 2).sum()))
    excluded_ratio = 1.0 + float(stats.t.ppf(0.5 + LEVEL / 2.0, observations - 1.0)) ** 2 / (observations - 1.0)
    possible = [best]
    for latency, mine in squares.items():
        worse = mine - squares[best]
        error = float(worse.std(ddof=1)) / np.sqrt(n)
        by_trials = float(worse.mean()) > float(stats.t.ppf(0.5 + LEVEL / 2.0, n - 1)) * error
        by_sum = float(mine.sum()) > excluded_ratio * float(squares[best].sum())
        if not (by_trials and by_sum if noisy else by_trials or by_sum):
            possible.append(latency)
    if max(possible) - min(possible) >= 2.0 * WIDEST["latency_steps"]:
        return NOT_IDENTIFIABLE
    return Estimated(float(best), float(min(possible)), float(max(possible)))


def _noise_of(model: GapModel, parameters: Parameters) -> Estimated:
    """Noise at each step with its interval."""
    each, samples = noise_of_each(model, parameters)
    if len(each) < FEWEST_TRIALS or samples < FEWEST_SAMPLES:
        return NOT_IDENTIFIABLE
    reach = float(stats.t.ppf(0.5 + LEVEL / 2.0, len(each) - 1)) * float(each.std(ddof=1)) / np.sqrt(len(each))
    reach *= _OWN_NOISE if model.copies > 1 else 1.0
    value = float(np.sqrt(np.mean(each**2)))
    return Estimated(
        round(value, 5), round(max(0.0, value - reach - WIRE / 4.0), 5), round(value + reach + WIRE / 4.0, 5)
    )


def _each(values: Float, half: Float, widest: float, enough: NDArray[np.bool_]) -> tuple[Estimated, ...]:
    return tuple(
        Estimated(round(float(v), 4), round(float(v - h), 4), round(float(v + h), 4))
        if known and h <= widest
        else NOT_IDENTIFIABLE
        for v, h, known in zip(values, half, enough, strict=True)
    )

"""Which gap makes a simulated body behave like a real robot: estimated from the robot's own traces.

Least squares between what the robot's sensors read and what `backends.simulation.gap_model` expects, over all samples
of the first steps of every trial, for every latency. Intervals come from the trials as they differ from each other: a
jackknife over whole trials (Quenouille 1956, Tukey 1958), with one Gauss-Newton step for each trial left out. They hold
for errors that are correlated within a trial, such as wheels that slip, and say nothing of what no gap can describe.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from backends.simulation.body import SimulatedBody
from backends.simulation.gap_model import Float, GapModel, Observed, Parameters
from sceann_hil.network.controller import SENSOR_MAX
from sceann_hil.robot import NOT_IDENTIFIABLE, Estimated, GapEstimate, Trace

LEVEL = 0.95
FEWEST_TRIALS = 3
"""Fewer different trials give no interval."""
FEWEST_SAMPLES = 20
"""Fewer samples in range say nothing of a sensor."""
MOST_LATENCY = 10
WIDEST = {"sensor_offset": 0.1, "sensor_gain": 0.3, "motor_gain": 0.3, "latency_steps": 2.0}
"""Half widths of intervals beyond which the trials do not tell a quantity."""

_GAINS = np.arange(0.4, 1.61, 0.2)
_LATENCIES_TRIED = 5
_WIRE = 1.0 / SENSOR_MAX
_ROUNDING = 0.5 * _WIRE
"""Sensors are rounded to wire values; the same rounding in every trial hides in no interval over trials."""
_GAIN_ROUNDING = 0.002
_OWN_NOISE = 2.2
"""Intervals are so much wider for a body with noise of its own, whose expected path is a mean of few copies. It was
chosen for intervals that hold the truth in 95 % of drawn robots (diffdrive with its motion noise)."""
_BODY_NOISE_FLOOR = 0.01
"""Deviation that a noisy body's sensors are given at least: few copies cannot tell that a value never occurs."""
_HOPELESS = 4.0
"""A latency that fits so many times worse is not fitted any further."""
_FREEDOM = 4.0
"""Of the t distribution whose weights keep a rare slip from ruling the fit."""
_KEPT, _KEPT_SQUARE = 0.9, 0.623
"""Part of the differences that the noise is taken from, the smallest ones, and their mean square if normal."""


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
    fits, weights, noise = _fitted(model)
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


@dataclass(frozen=True)
class _Fit:
    """A least-squares fit for one latency.

    Attributes:
        parameters: the best ones.
        residual: what is left, shape ``(n, s, n_sensors)``.
        misfit: weighted sum of squares.
    """

    parameters: Parameters
    residual: Float
    misfit: float


def _fitted(model: GapModel) -> tuple[list[_Fit], Float, float]:
    """Fits of the promising latencies with common weights, the weights, and the noise that they are made with."""
    noise = 0.01
    weights = np.where(model.observed.known, noise**-2, 0.0) * np.ones(model.robot.spec.n_sensors)
    fits = [_least_squares(model, start, noise, weights, 6) for start in _starting_points(model)]
    for _ in range(3):
        best = min(fits, key=lambda fit: fit.misfit)
        noise = float(np.sqrt(np.mean(_noise_of_each(model, best.parameters)[0] ** 2)))
        weights = _weights(model, best, noise)
        likely = (fit.parameters for fit in fits if fit.misfit < _HOPELESS * best.misfit)
        tried = {parameters.latency: parameters for parameters in likely}
        for aside in (best.parameters.latency - 1, best.parameters.latency + 1):
            if 0 <= aside <= _most_latency(model) and aside not in tried:
                tried[aside] = Parameters(
                    best.parameters.offset, best.parameters.gain, best.parameters.motor_gain, aside
                )
        fits = [_least_squares(model, start, noise, weights, 5) for start in tried.values()]
    return fits, weights, noise


def _most_latency(model: GapModel) -> int:
    return min(MOST_LATENCY, int(model.observed.motors.shape[1]) - 1)


def _starting_points(model: GapModel) -> list[Parameters]:
    """The best motor gains of a coarse grid for each of the most promising latencies."""
    n_sensors, n_motors = model.robot.spec.n_sensors, model.robot.spec.n_motors
    coarse = GapModel(model.robot, model.observed, copies=4)
    together = n_motors > 2
    gains = [(gain,) * n_motors for gain in _GAINS] if together else list(itertools.product(_GAINS, repeat=n_motors))
    none = Parameters.none(n_sensors, n_motors)
    found = []
    for latency in range(_most_latency(model) + 1):
        points = [Parameters(none.offset, none.gain, np.array(gain), latency) for gain in gains]
        sums = [_rough_misfit(coarse, point) for point in points]
        found.append((min(sums), points[int(np.argmin(sums))]))
    found.sort(key=lambda pair: pair[0])
    return [point for _, point in found[:_LATENCIES_TRIED]]


def _rough_misfit(model: GapModel, parameters: Parameters) -> float:
    left = model.observed.sensors - np.clip(model.sensed(parameters), 0.0, 1.0).mean(axis=1)
    return float((np.where(model.observed.known, left, 0.0) ** 2).sum())


def _prior(n_sensors: int, n_motors: int) -> Float:
    """Precisions that keep a quantity that the trials do not tell near its default."""
    return np.concatenate([np.full(n_sensors, 0.2), np.full(n_sensors, 0.3), np.full(n_motors, 0.4)]) ** -2


def _least_squares(model: GapModel, start: Parameters, noise: float, weights: Float, most: int) -> _Fit:
    """Levenberg and Marquardt's method; SciPy's does not know that most derivatives cost nothing here."""
    spec = model.robot.spec
    prior, default = _prior(spec.n_sensors, spec.n_motors), Parameters.none(spec.n_sensors, spec.n_motors).vector

    def fit_at(parameters: Parameters) -> _Fit:
        residual = model.residual(parameters, noise)
        penalty = float((prior * (parameters.vector - default) ** 2).sum())
        return _Fit(parameters, residual, float((weights * residual**2).sum()) + penalty)

    now, damping = fit_at(start), 1e-3
    for _ in range(most):
        jacobian = model.jacobian(now.parameters, noise)
        square = np.einsum("tsjk,tsjl,tsj->kl", jacobian, jacobian, weights) + np.diag(prior)
        slope = np.einsum("tsjk,tsj,tsj->k", jacobian, weights, now.residual)
        slope += prior * (now.parameters.vector - default)
        before = now
        for _ in range(6):
            step = np.linalg.solve(square + damping * np.diag(np.diag(square)), slope)
            tried = fit_at(now.parameters.moved_to(now.parameters.vector - step))
            if tried.misfit < now.misfit:
                now, damping = tried, max(damping / 5.0, 1e-6)
                break
            damping *= 5.0
        if before.misfit - now.misfit <= 1e-6 * before.misfit:
            break
    return now


def _weights(model: GapModel, fit: _Fit, noise: float) -> Float:
    """One over the variance of each sample, less where the sample is far off; 0 where a trial was over."""
    variance = np.full(fit.residual.shape, noise**2 + _WIRE**2 / 12.0 + 1e-6)
    if model.copies > 1:
        own = model.expected(fit.parameters, 0.0).var(axis=1)
        padded = np.pad(own, ((0, 0), (2, 2), (0, 0)), mode="edge")
        around = np.stack([padded[:, shift : shift + own.shape[1]] for shift in range(5)]).mean(axis=0)
        variance += around + _BODY_NOISE_FLOOR**2
    weights = 1.0 / variance
    if model.copies > 1:
        weights *= (_FREEDOM + 1.0) / (_FREEDOM + fit.residual**2 / variance)
    return np.where(model.observed.known, weights, 0.0)


def _half_widths(model: GapModel, fit: _Fit, weights: Float, noise: float) -> Float:
    """Half of each parameter's interval, in the order of `Parameters.vector`; infinite with too few trials."""
    spec, n = model.robot.spec, len(model.observed.starts)
    if n < FEWEST_TRIALS:
        return np.full(len(fit.parameters.vector), np.inf)
    jacobian = model.jacobian(fit.parameters, noise)
    squares = np.einsum("tsjk,tsjl,tsj->tkl", jacobian, jacobian, weights)
    slopes = np.einsum("tsjk,tsj,tsj->tk", jacobian, weights, fit.residual)
    prior = np.diag(_prior(spec.n_sensors, spec.n_motors))
    whole = squares.sum(axis=0) + prior
    left_out = np.stack([np.linalg.solve(whole - one, slope) for one, slope in zip(squares, slopes, strict=True)])
    left_out -= left_out.mean(axis=0)
    inverse = np.linalg.inv(whole)
    variance = (n - 1) / n * (left_out**2).sum(axis=0) + np.diag(inverse @ prior @ inverse)
    reach = float(stats.t.ppf(0.5 + LEVEL / 2.0, n - 1)) * (_OWN_NOISE if model.copies > 1 else 1.0)
    rounding = np.full(len(variance), _GAIN_ROUNDING)
    rounding[: spec.n_sensors] = _ROUNDING
    return np.asarray(reach * np.sqrt(variance) + rounding)


def _latency(fits: list[_Fit], weights: Float, *, noisy: bool) -> Estimated:
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
    each, samples = _noise_of_each(model, parameters)
    if len(each) < FEWEST_TRIALS or samples < FEWEST_SAMPLES:
        return NOT_IDENTIFIABLE
    reach = float(stats.t.ppf(0.5 + LEVEL / 2.0, len(each) - 1)) * float(each.std(ddof=1)) / np.sqrt(len(each))
    reach *= _OWN_NOISE if model.copies > 1 else 1.0
    value = float(np.sqrt(np.mean(each**2)))
    return Estimated(
        round(value, 5), round(max(0.0, value - reach - _WIRE / 4.0), 5), round(value + reach + _WIRE / 4.0, 5)
    )


def _noise_of_each(model: GapModel, parameters: Parameters) -> tuple[Float, int]:
    """Deviation of the noise in each trial that has enough samples, and how many samples there are.

    Taken from how what is left changes from one step to the next: what a wrong gap leaves changes slowly. What a
    body's own noise does from step to step is taken off.
    """
    copies = model.expected(parameters, 0.0)
    expected = copies.mean(axis=1)
    in_range = model.observed.in_range & (expected > 0.0) & (expected < 1.0)
    pairs = in_range[:, 1:] & in_range[:, :-1]
    changes = np.diff(model.observed.sensors - expected, axis=1)
    own = np.diff(copies - expected[:, None], axis=2)
    found = []
    for trial, which in enumerate(pairs):
        if which.sum() >= 8:
            square = _trimmed_square(changes[trial][which]) / 2.0 - _WIRE**2 / 12.0
            if model.copies > 1:
                square -= _trimmed_square(own[trial][:, which].ravel()) / 2.0
            found.append(np.sqrt(max(square, 0.0)))
    return np.array(found or [0.0]), int(pairs.sum())


def _trimmed_square(values: Float) -> float:
    """Mean square of normal values of which a few may be something else."""
    squares = np.sort(values**2)
    return float(squares[: max(1, int(_KEPT * len(squares)))].mean()) / _KEPT_SQUARE


def _each(values: Float, half: Float, widest: float, enough: NDArray[np.bool_]) -> tuple[Estimated, ...]:
    return tuple(
        Estimated(round(float(v), 4), round(float(v - h), 4), round(float(v + h), 4))
        if known and h <= widest
        else NOT_IDENTIFIABLE
        for v, h, known in zip(values, half, enough, strict=True)
    )

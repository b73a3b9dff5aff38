"""The gap that fits best: weighted least squares over all samples, for every latency that is promising.

What weighs a sample, and the sensors' noise, come from what the fit before left.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from backends.simulation.gap_model import Float, GapModel, Parameters
from sceann_hil.network.controller import SENSOR_MAX

MOST_LATENCY = 10
_GAINS = np.arange(0.4, 1.61, 0.2)
_LATENCIES_TRIED = 5
WIRE = 1.0 / SENSOR_MAX
_BODY_NOISE_FLOOR = 0.01
"""Deviation that a noisy body's sensors are given at least: few copies cannot tell that a value never occurs."""
_HOPELESS = 4.0
"""A latency that fits so many times worse is not fitted any further."""
_FREEDOM = 4.0
"""Of the t distribution whose weights keep a rare slip from ruling the fit."""
_KEPT, _KEPT_SQUARE = 0.9, 0.623
"""Part of the differences that the noise is taken from, the smallest ones, and their mean square if normal."""


@dataclass(frozen=True)
class Fit:
    """A least-squares fit for one latency.

    Attributes:
        parameters: the best ones.
        residual: what is left, shape ``(n, s, n_sensors)``.
        misfit: weighted sum of squares.
    """

    parameters: Parameters
    residual: Float
    misfit: float


def fitted(model: GapModel) -> tuple[list[Fit], Float, float]:
    """Fits of the promising latencies with common weights, the weights, and the noise that they are made with."""
    noise = 0.01
    weights = np.where(model.observed.known, noise**-2, 0.0) * np.ones(model.robot.spec.n_sensors)
    fits = [_least_squares(model, start, noise, weights, 6) for start in _starting_points(model)]
    for _ in range(3):
        best = min(fits, key=lambda fit: fit.misfit)
        noise = float(np.sqrt(np.mean(noise_of_each(model, best.parameters)[0] ** 2)))
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


def prior_precisions(n_sensors: int, n_motors: int) -> Float:
    """Precisions that keep a quantity that the trials do not tell near its default."""
    return np.concatenate([np.full(n_sensors, 0.2), np.full(n_sensors, 0.3), np.full(n_motors, 0.4)]) ** -2


def _least_squares(model: GapModel, start: Parameters, noise: float, weights: Float, most: int) -> Fit:
    """Levenberg and Marquardt's method; SciPy's does not know that most derivatives cost nothing here."""
    spec = model.robot.spec
    prior, default = (
        prior_precisions(spec.n_sensors, spec.n_motors),
        Parameters.none(spec.n_sensors, spec.n_motors).vector,
    )

    def fit_at(parameters: Parameters) -> Fit:
        residual = model.residual(parameters, noise)
        penalty = float((prior * (parameters.vector - default) ** 2).sum())
        return Fit(parameters, residual, float((weights * residual**2).sum()) + penalty)

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


def _weights(model: GapModel, fit: Fit, noise: float) -> Float:
    """One over the variance of each sample, less where the sample is far off; 0 where a trial was over."""
    variance = np.full(fit.residual.shape, noise**2 + WIRE**2 / 12.0 + 1e-6)
    if model.copies > 1:
        own = model.expected(fit.parameters, 0.0).var(axis=1)
        padded = np.pad(own, ((0, 0), (2, 2), (0, 0)), mode="edge")
        around = np.stack([padded[:, shift : shift + own.shape[1]] for shift in range(5)]).mean(axis=0)
        variance += around + _BODY_NOISE_FLOOR**2
    weights = 1.0 / variance
    if model.copies > 1:
        weights *= (_FREEDOM + 1.0) / (_FREEDOM + fit.residual**2 / variance)
    return np.where(model.observed.known, weights, 0.0)


def noise_of_each(model: GapModel, parameters: Parameters) -> tuple[Float, int]:
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
            square = _trimmed_square(changes[trial][which]) / 2.0 - WIRE**2 / 12.0
            if model.copies > 1:
                square -= _trimmed_square(own[trial][:, which].ravel()) / 2.0
            found.append(np.sqrt(max(square, 0.0)))
    return np.array(found or [0.0]), int(pairs.sum())


def _trimmed_square(values: Float) -> float:
    """Mean square of normal values of which a few may be something else."""
    squares = np.sort(values**2)
    return float(squares[: max(1, int(_KEPT * len(squares)))].mean()) / _KEPT_SQUARE

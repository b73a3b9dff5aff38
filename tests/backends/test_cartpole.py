"""The cart-pole against its textbook equations in float64."""

from __future__ import annotations

import numpy as np
import pytest

from backends.cartpole import CartPole, CartPoleConfig, Integrator
from sceann_hil.network.controller import quantise_sensors
from sceann_hil.robot import EndReason
from tests.backends.conftest import MakeTrials

LIMITS = (2.4, np.deg2rad(36.0))


def textbook_step(state: np.ndarray, force: np.ndarray, tick: float, implicit: bool) -> np.ndarray:
    """Barto, Sutton & Anderson (1983) without friction."""
    x, v, angle, rate = state.astype(np.float64).T
    s, c = np.sin(angle), np.cos(angle)
    rate_dot = (9.8 * s + c * (-force - 0.1 * 0.5 * rate**2 * s) / 1.1) / (0.5 * (4 / 3 - 0.1 * c**2 / 1.1))
    v_dot = (force + 0.1 * 0.5 * (rate**2 * s - rate_dot * c)) / 1.1
    new_v, new_rate = v + tick * v_dot, rate + tick * rate_dot
    dx, dangle = (new_v, new_rate) if implicit else (v, rate)
    return np.stack([x + tick * dx, new_v, angle + tick * dangle, new_rate], axis=1)


@pytest.mark.parametrize("integrator", Integrator)
def test_every_step_is_the_textbook_s(integrator: Integrator, make_trials: MakeTrials) -> None:
    robot = CartPole(CartPoleConfig(n_sensors=2, integrator=integrator))
    results = robot.trace(make_trials(robot, 60, start=(0.3, -0.5, 0.1, 0.4), max_steps=300, n_hidden=3))
    assert results.traces is not None
    for trace in results.traces:
        force = 10.0 * (2.0 * trace.x[:, -1] / 1024.0 - 1.0)
        expected = textbook_step(trace.state[:-1], force, 0.02, integrator is Integrator.SEMI_IMPLICIT_EULER)
        assert np.abs(expected - trace.state[1:]).max() < 1e-5


@pytest.mark.parametrize("n_sensors", [2, 4])
def test_sensors_are_the_scaled_state(n_sensors: int, make_trials: MakeTrials) -> None:
    robot = CartPole(CartPoleConfig(n_sensors=n_sensors))
    results = robot.trace(make_trials(robot, 20, start=(0.1, 0.2, 0.05, -0.3), max_steps=200))
    assert results.traces is not None
    ranges = np.array([2.4, 3.0, np.deg2rad(36.0), 3.5])
    for trace in results.traces:
        scaled = (trace.state[:-1].astype(float) / ranges + 1) / 2
        expected = quantise_sensors(scaled[:, [0, 2, 1, 3][:n_sensors]]).astype(int)
        # float32 and float64 may round a value between two wire values to different sides
        assert np.abs(expected - trace.sensors).max() <= 1
        assert (expected != trace.sensors).sum() <= max(2, 0.01 * expected.size)


def test_masses_lengths_and_friction_are_those_of_the_equations(make_trials: MakeTrials) -> None:
    cart, pole, half, force_n, cart_friction, pole_friction = 3.0, 0.7, 0.3, 25.0, 0.8, 0.05
    robot = CartPole(
        CartPoleConfig(
            cart_kg=cart,
            pole_kg=pole,
            pole_half_length_m=half,
            largest_force_n=force_n,
            track_m=1.5,
            largest_angle_deg=20.0,
            cart_friction_n_s_m=cart_friction,
            pole_friction_n_m_s=pole_friction,
        )
    )
    results = robot.trace(make_trials(robot, 60, start=(0.3, -0.5, 0.1, 0.4), max_steps=300, n_hidden=3))
    assert results.traces is not None
    assert set(results.end_reasons.tolist()) <= {EndReason.FELL, EndReason.OUT_OF_BOUNDS}
    mass = cart + pole
    for trace in results.traces:
        state = trace.state[:-1].astype(np.float64)
        _, v, angle, rate = state.T
        s, c = np.sin(angle), np.cos(angle)
        force = force_n * (2.0 * trace.x[:, -1] / 1024.0 - 1.0) - cart_friction * v
        # Barto, Sutton and Anderson (1983) with friction, the cart's by its speed
        push = 9.8 * s - c * (force + pole * half * rate**2 * s) / mass - pole_friction * rate / (pole * half)
        rate_dot = push / (half * (4 / 3 - pole * c**2 / mass))
        v_dot = (force + pole * half * (rate**2 * s - rate_dot * c)) / mass
        expected = state + 0.02 * np.stack([v, v_dot, rate, rate_dot], axis=1)
        assert np.abs(expected - trace.state[1:]).max() < 2e-5
        out = np.abs(trace.state[:, [0, 2]]) > np.float32((1.5, np.deg2rad(20.0)))
        assert out[-1].any()
        assert not out[:-1].any()


def test_a_trial_ends_as_soon_as_the_pole_or_the_cart_is_out(make_trials: MakeTrials) -> None:
    robot = CartPole()
    starts = np.array([[0, 0, 0.0175, 0], [2.39, 3.0, 0, 0], [0, 0, 0.62, 2.0]]).repeat(40, axis=0)
    results = robot.trace(make_trials(robot, 120, start=starts, max_steps=2000))
    assert results.traces is not None
    for reason, trace in zip(results.end_reasons, results.traces, strict=True):
        out = np.abs(trace.state[:, [0, 2]]) > np.float32(LIMITS)
        assert not out[:-1].any()
        assert out[-1, 0] == (reason == EndReason.OUT_OF_BOUNDS)
        assert out[-1].any() == (reason != EndReason.TIME_UP)
    assert {EndReason.FELL, EndReason.OUT_OF_BOUNDS} <= set(results.end_reasons.tolist())


def test_only_two_or_four_sensors_exist() -> None:
    with pytest.raises(ValueError, match="n_sensors"):
        CartPole(CartPoleConfig(n_sensors=3))

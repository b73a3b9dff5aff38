"""The differential drive against Eq. (4) in float64, and its sensors against plain geometry."""

from __future__ import annotations

import numpy as np
import pytest

from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.world.body import WorldDrive
from backends.world.config import InfraredConfig, WorldConfig
from sceann_hil.network.controller import quantise_sensors
from sceann_hil.robot import EndReason, Trace
from tests.backends.conftest import MakeTrials

CORNER = (0.0275, 0.0275, 0.6)


def wrapped(angle: np.ndarray) -> np.ndarray:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def displacement(trace: Trace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eq. (4) without its errors, for the defaults."""
    left, right = (0.08 * 0.2 * trace.x[:, -2:].astype(float) / 1024).T
    heading = trace.state[:-1, 2].astype(float)
    forward = (left + right) / 2
    return forward * np.cos(heading), forward * np.sin(heading), (right - left) / (2 * 0.0275)


def traces_of(robot: DifferentialDrive, make_trials: MakeTrials, n: int = 60, start: object = CORNER) -> list[Trace]:
    traces = robot.trace(make_trials(robot, n, start=start, max_steps=200)).traces
    assert traces is not None
    return list(traces)


def test_every_step_is_equation_4_clamped_at_the_walls(make_trials: MakeTrials) -> None:
    for trace in traces_of(DifferentialDrive(DifferentialDriveConfig(n_sensors=5, motion_noise=0.0)), make_trials):
        dx, dy, turn = displacement(trace)
        old, new = trace.state[:-1].astype(float), trace.state[1:].astype(float)
        assert np.abs(np.clip(old[:, 0] + dx, 0.0275, 0.5725) - new[:, 0]).max() < 1e-6
        assert np.abs(np.clip(old[:, 1] + dy, 0.0275, 0.5725) - new[:, 1]).max() < 1e-6
        assert np.abs(wrapped(old[:, 2] + turn - new[:, 2])).max() < 1e-5


def test_errors_are_a_tenth_of_the_displacement(make_trials: MakeTrials) -> None:
    robot = DifferentialDrive(DifferentialDriveConfig(n_sensors=5, arena_m=(100.0, 100.0), target_m=(99.0, 99.0)))
    errors = []
    for trace in traces_of(robot, make_trials, 200, (50.0, 50.0, 0.6)):
        steps = np.diff(trace.state.astype(float), axis=0)
        expected = np.stack(displacement(trace), axis=1)
        steps[:, 2] = wrapped(steps[:, 2])
        large = np.abs(expected) > [3e-3, 3e-3, 3e-3]
        errors.append(np.where(large, (steps - expected) / np.where(large, np.abs(expected), 1.0), np.nan))
    relative = np.concatenate(errors)
    assert np.nanstd(relative, axis=0) == pytest.approx([0.1, 0.1, 0.1], rel=0.03)
    assert np.abs(np.nanmean(relative, axis=0)).max() < 0.002
    assert np.abs(np.ma.corrcoef(np.ma.masked_invalid(relative).T) - np.eye(3)).max() < 0.03


@pytest.mark.parametrize("n_sensors", [1, 2, 3, 5, 7])
def test_a_sensor_reads_d0_over_distance_if_the_target_is_in_its_cone(n_sensors: int, make_trials: MakeTrials) -> None:
    robot = DifferentialDrive(DifferentialDriveConfig(n_sensors=n_sensors))
    centres = (np.arange(n_sensors) + 0.5) * 120 / n_sensors - 60
    assert np.degrees(robot.parameters[10:]) == pytest.approx(centres)
    for trace in traces_of(robot, make_trials):
        x, y, heading = trace.state[:-1].astype(float).T
        d = np.hypot(0.55 - x, 0.55 - y)
        bearing = wrapped(np.arctan2(0.55 - y, 0.55 - x) - heading)
        off_axis = np.abs(wrapped(bearing[:, None] - np.radians(centres)))
        half = (np.radians(15) + np.arcsin(0.05 / d))[:, None]
        seen = np.where(off_axis <= half, np.minimum(1, 0.05 / (d - 0.0775))[:, None], 0.0)
        clear = np.abs(off_axis - half) > 1e-4
        assert np.abs(quantise_sensors(seen).astype(int) - trace.sensors)[clear].max() <= 1


def test_the_goal_is_reached_when_the_bodies_touch(make_trials: MakeTrials) -> None:
    robot = DifferentialDrive(DifferentialDriveConfig(n_sensors=3, motion_noise=0.0))
    results = robot.trace(make_trials(robot, 200, start=(0.3, 0.3, 0.78), max_steps=200))
    assert results.traces is not None
    reached = 0
    for reason, trace in zip(results.end_reasons, results.traces, strict=True):
        d = np.hypot(0.55 - trace.state[1:, 0].astype(float), 0.55 - trace.state[1:, 1].astype(float))
        assert (d[:-1] > 0.0775 - 1e-6).all()
        assert (d[-1] <= 0.0775 + 1e-6) == (reason == EndReason.GOAL)
        reached += reason == EndReason.GOAL
    assert reached > 10


def test_a_body_with_a_world_is_another_one() -> None:
    config = DifferentialDriveConfig(world=WorldConfig(infrared=(InfraredConfig(direction_deg=0.0),)))
    with pytest.raises(ValueError, match="world: expected none"):
        DifferentialDrive(config)
    assert isinstance(config.build(), WorldDrive)

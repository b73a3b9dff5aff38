"""The reality gap: each imperfection does what it says and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from backends.cartpole import CartPole
from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.simulation.gap import GAP_FIXED, Gap, Spread
from backends.virtual.body import VirtualBody
from sceann_hil.errors import ConfigError
from sceann_hil.seeds import Purpose, keys
from tests.backends.conftest import MakeTrials
from tests.runs import POLE, config_of

MIDDLE = (0.3, 0.3, 0.78)


def drive(gap: Gap, **settings: float) -> DifferentialDrive:
    return DifferentialDrive(DifferentialDriveConfig(n_sensors=3, motion_noise=0.0, **settings), gap=gap)


def motion(robot: DifferentialDrive, make_trials: MakeTrials) -> tuple[np.ndarray, np.ndarray]:
    """Motor outputs (n, 2) and turns (n,) of one long trial in a wide arena."""
    robot = DifferentialDrive(
        DifferentialDriveConfig(n_sensors=3, motion_noise=0.0, arena_m=(90.0, 90.0), target_m=(80.0, 80.0)),
        gap=robot.gap,
    )
    traces = robot.trace(make_trials(robot, 1, start=(45.0, 45.0, 0.78), max_steps=100, seed=3)).traces
    assert traces is not None
    turns = np.diff(np.unwrap(traces[0].state[:, 2].astype(float)))
    return traces[0].x[:, -2:].astype(float) / 1024, turns


def turn_of(motors: np.ndarray) -> np.ndarray:
    return (motors[:, 1] - motors[:, 0]) * 0.08 * 0.2 / 0.055


def test_no_gap_is_the_default_and_costs_no_draws() -> None:
    assert Gap().is_none
    assert Gap().draw(keys(1, Purpose.TRIAL, [1, 2]), 3, 2, 0.0).shape == (0, 0)


def test_fixed_offset_and_gain_change_what_the_controller_sees(make_trials: MakeTrials) -> None:
    plain, altered = drive(Gap()), drive(Gap(sensor_offset=Spread(0.1), sensor_gain=Spread(0.5)))
    trials = make_trials(plain, 1, start=MIDDLE, max_steps=1)
    before, after = plain.trace(trials).traces, altered.trace(trials).traces
    assert before is not None
    assert after is not None
    expected = 0.5 * before[0].sensors[0] + 0.1 * 1023
    assert np.abs(after[0].sensors[0] - expected).max() <= 1


def test_sensor_noise_has_its_deviation(make_trials: MakeTrials) -> None:
    robot = CartPole(gap=Gap(sensor_noise=Spread(0.02)))
    results = robot.trace(make_trials(robot, 2000, start=(0, 0, 0, 0), max_steps=1))
    assert results.traces is not None
    first = np.array([trace.sensors[0] for trace in results.traces]) / 1023
    assert first.mean(axis=0) == pytest.approx([0.5, 0.5], abs=0.002)
    assert first.std(axis=0) == pytest.approx([0.02, 0.02], rel=0.06)
    assert abs(np.corrcoef(first.T)[0, 1]) < 0.1


def test_motor_gain_and_latency_change_what_the_body_does(make_trials: MakeTrials) -> None:
    for delay in (0, 1, 4):
        motors, turns = motion(drive(Gap(latency_steps=Spread(delay), motor_gain=Spread(0.5))), make_trials)
        effective = np.concatenate([np.zeros((delay, 2)), motors[: len(motors) - delay]])
        assert np.abs(0.5 * turn_of(effective) - turns).max() < 1e-4


def test_a_motor_inside_its_dead_band_stands_still(make_trials: MakeTrials) -> None:
    motors, turns = motion(drive(Gap(motor_dead_band=Spread(0.6))), make_trials)
    assert np.abs(turn_of(np.where(motors < 0.6, 0.0, motors)) - turns).max() < 1e-4


def test_the_cart_s_motor_stands_still_at_one_half(make_trials: MakeTrials) -> None:
    robot = CartPole(gap=Gap(motor_dead_band=Spread(0.9)))
    results = robot.trace(make_trials(robot, 5, start=(0.5, 0, 0, 0), max_steps=50))
    assert results.traces is not None
    assert all(np.all(trace.state[:, 0] == np.float32(0.5)) for trace in results.traces)


def test_spreads_are_drawn_per_trial_and_per_sensor_from_the_key_alone() -> None:
    gap = Gap(sensor_offset=Spread(0.5, half_width=0.25), motor_gain=Spread(1.0, deviation=0.1))
    some = keys(1, Purpose.TRIAL, np.arange(4000))
    drawn = gap.draw(some, 3, 2, 0.0)
    offsets, gains = drawn[:, GAP_FIXED : GAP_FIXED + 3], drawn[:, GAP_FIXED + 6 :]
    assert offsets.min() >= 0.25
    assert offsets.max() <= 0.75
    assert offsets.mean(axis=0) == pytest.approx([0.5] * 3, abs=0.01)
    assert offsets.std(axis=0) == pytest.approx([0.25 / np.sqrt(3)] * 3, rel=0.05)
    assert gains.mean(axis=0) == pytest.approx([1.0] * 2, abs=0.01)
    assert gains.std(axis=0) == pytest.approx([0.1] * 2, rel=0.05)
    assert np.abs(np.corrcoef(np.hstack([offsets, gains]).T) - np.eye(5)).max() < 0.08
    assert np.array_equal(gap.draw(some[17:18], 3, 2, 0.0)[0], drawn[17])


def test_a_list_gives_each_sensor_and_motor_its_own_value() -> None:
    gap = Gap(
        sensor_offset=(Spread(0.1), Spread(-0.2), Spread(0.0, half_width=0.5)),
        sensor_gain=(Spread(1.0), Spread(0.5), Spread(2.0)),
        motor_gain=(Spread(0.8), Spread(1.1)),
    )
    drawn = gap.draw(keys(1, Purpose.TRIAL, np.arange(100)), 3, 2, 0.0)
    fixed = drawn[:, [GAP_FIXED, GAP_FIXED + 1, *range(GAP_FIXED + 3, GAP_FIXED + 8)]]
    assert np.array_equal(fixed, np.tile(np.float32([0.1, -0.2, 1.0, 0.5, 2.0, 0.8, 1.1]), (100, 1)))
    assert np.ptp(drawn[:, GAP_FIXED + 2]) > 0.5


def test_a_list_of_one_value_for_each_draws_what_the_one_value_draws() -> None:
    spread = Spread(1.0, deviation=0.2)
    some = keys(1, Purpose.TRIAL, np.arange(50))
    one, each = Gap(motor_gain=spread, sensor_offset=spread), Gap(motor_gain=(spread,) * 2, sensor_offset=(spread,) * 3)
    assert np.array_equal(one.draw(some, 3, 2, 0.0), each.draw(some, 3, 2, 0.0))


def test_a_list_of_the_wrong_length_is_refused() -> None:
    with pytest.raises(ValueError, match=r"motor_gain: expected .* each of 2 motors, got 3 values"):
        Gap(motor_gain=(Spread(1.0),) * 3).draw(keys(1, Purpose.TRIAL), 3, 2, 0.0)


def test_a_robot_s_gap_is_the_same_in_all_its_trials_and_another_robot_s_is_another() -> None:
    gap = Gap(motor_gain=Spread(1.0, deviation=0.1), sensor_noise=Spread(0.02, half_width=0.01))
    some = keys(1, Purpose.TRIAL, np.arange(20))
    first, second = gap.of_robot(1).draw(some, 3, 2, 0.0), gap.of_robot(2).draw(some, 3, 2, 0.0)
    assert np.ptp(first, axis=0).max() == 0.0
    assert np.all(first[0, GAP_FIXED + 6 :] != second[0, GAP_FIXED + 6 :])
    assert gap.of_robot(1).of_robot(2) == gap.of_robot(1)
    gains = [gap.of_robot(number).draw(some[:1], 3, 2, 0.0)[0, -1] for number in range(500)]
    assert np.std(gains) == pytest.approx(0.1, rel=0.1)


def test_a_robot_s_noise_is_still_another_in_each_trial(make_trials: MakeTrials) -> None:
    robot = CartPole(gap=Gap(sensor_noise=Spread(0.02)).of_robot(5))
    results = robot.trace(make_trials(robot, 50, start=(0, 0, 0, 0), max_steps=1))
    assert results.traces is not None
    assert len({tuple(trace.sensors[0].tolist()) for trace in results.traces}) > 25


def test_a_virtual_robot_keeps_its_gap_from_one_placing_to_the_next() -> None:
    robot = CartPole(gap=Gap(sensor_offset=Spread(0.0, half_width=0.2)))
    bodies = [VirtualBody(robot, seed) for seed in (1, 1, 2)]
    sensed = []
    for body in bodies:
        for _ in range(3):
            body.place([0.0, 0.0, 0.0, 0.0])
            sensed.append(tuple(body.sense()))
    assert len(set(sensed[:6])) == 1
    assert len(set(sensed)) == 2


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("{sensor_offset: [0.1]}", r"robot.gap.sensor_offset.*one for each of 2 sensors, got 1 values"),
        ("{motor_gain: [0.9, 1.1]}", r"robot.gap.motor_gain.*one for each of 1 motors, got 2 values"),
        ("{sensor_offset: []}", r"sensor_offset"),
        ("{sensor_offset: [0.1, high]}", r"sensor_offset"),
        ("{sensor_noise: [0.1, 0.2]}", r"sensor_noise"),
        ("{drawn: per_run}", r"drawn.*per_trial.*per_robot"),
        ("{drawn: per_robot, robot: -1}", r"robot.gap.robot"),
    ],
)
def test_lists_and_words_that_do_not_fit_are_refused_with_the_key(section: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        config_of(POLE, f"robot.gap={section}")


def test_a_configuration_s_lists_become_the_gap_and_lists_of_defaults_are_none() -> None:
    config = config_of(POLE, "robot.gap={sensor_offset: [0.01, {normal: [0, 0.1]}], drawn: per_robot, robot: 7}")
    assert config.robot.build().gap == Gap(  # type: ignore[attr-defined]
        sensor_offset=(Spread(0.01), Spread(0.0, deviation=0.1)), robot_number=7
    )
    assert config_of(POLE, "robot.gap={sensor_offset: [0, 0], motor_gain: [1]}").robot.spec.noise_free


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ("{sensor_offset: [0.1, high]}", r"sensor_offset\[1\]: expected a number or a section with normal or uniform"),
        ("{sensor_offset: [0.1, {uniform: [2]}]}", r"sensor_offset\[1\].uniform: expected 2 values, got a list of 1"),
        ("{sensor_offset: [0.1, {uniform: [2, 1]}]}", r"sensor_offset\[1\].uniform: expected \[smallest, largest\]"),
        ("{sensor_offset: [0, {unifrm: [1, 2]}]}", r"unknown key, did you mean robot.gap.sensor_offset\[1\].uniform"),
    ],
)
def test_what_is_wrong_inside_a_list_is_one_problem_at_its_place(section: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as refused:
        config_of(POLE, f"robot.gap={section}")
    assert "problems" not in str(refused.value)

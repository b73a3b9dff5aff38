"""The gap is found where the trials tell it, with intervals that hold it as often as they say; else nothing is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from backends.cartpole import CartPole
from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.simulation.engine import SimulatedRobot
from backends.simulation.gap import Gap, Spread
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.network.phenotype import Phenotype
from sceann_hil.robot import NOT_IDENTIFIABLE, Estimated, GapEstimate, Trace
from sceann_hil.robot.task import Task
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.tasks.goal_reach import GoalReach, GoalReachConfig
from sceann_hil.tasks.pole_balancing import PoleBalancing, PoleBalancingConfig

POLE = Phenotype(Coding.SCEANN3, NetworkSize(2, 3, 1), Dynamics())
POLE_TASK = PoleBalancing(PoleBalancingConfig(max_steps=300, start_angle_deg=4.0))
DRIVE = Phenotype(Coding.SCEANN3, NetworkSize(3, 2, 2), Dynamics())
DRIVE_TASK = GoalReach(GoalReachConfig(max_steps=100, start_m=(0.03, 0.03), headings_deg=(0.0, 90.0, 180.0, 270.0)))


def estimated(
    robot: SimulatedRobot, simulation: SimulatedRobot, phenotype: Phenotype, task: Task, genomes: int, seed: int
) -> GapEstimate:
    """From trials of random genomes on a robot."""
    rng = np.random.default_rng(seed)
    bits = rng.integers(0, 2, (genomes, phenotype.genome_length), dtype=np.uint8)
    noise = rng.integers(0, 2**63, (genomes, task.n_trials), dtype=np.uint64)
    traces = BatchEvaluator(phenotype, task, robot).trace(bits, noise).traces
    assert traces is not None
    return simulation.estimate_gap(np.tile(task.starts, (genomes, 1)), traces)


def of_pole(gap: Gap, genomes: int = 15, seed: int = 5) -> GapEstimate:
    return estimated(CartPole(gap=gap), CartPole(), POLE, POLE_TASK, genomes, seed)


def holds(found: Estimated, truth: float) -> bool:
    assert found.low is not None
    assert found.high is not None
    return found.low <= truth <= found.high


@pytest.mark.parametrize(
    ("offset", "gain", "latency"),
    [(0.0, 1.0, 0), (0.02, 1.0, 0), (0.0, 0.8, 0), (0.0, 0.8, 2), (-0.015, 0.9, 2), (0.01, 1.2, 1), (0.0, 0.43, 6)],
)
def test_a_cart_s_gap_is_found(offset: float, gain: float, latency: int) -> None:
    found = of_pole(Gap(sensor_offset=Spread(offset), motor_gain=Spread(gain), latency_steps=Spread(latency)))
    assert found.latency_steps.value == latency
    assert found.motor_gain[0].value == pytest.approx(gain, abs=0.01)
    assert [one.value for one in found.sensor_offset] == pytest.approx([offset] * 2, abs=0.003)
    assert [one.value for one in found.sensor_gain] == pytest.approx([1.0] * 2, abs=0.005)
    assert found.residual < 0.001
    assert found.residual <= found.residual_without


def test_intervals_hold_drawn_gaps_about_as_often_as_they_say() -> None:
    rng = np.random.default_rng(11)
    held: list[bool] = []
    for seed in range(40):
        offset, gain = rng.normal(0.0, 0.02, 2), rng.normal(1.0, 0.1, 2)
        motor, latency, noise = rng.uniform(0.6, 1.2), int(rng.integers(0, 4)), float(rng.choice([0.0, 0.01]))
        gap = Gap(
            sensor_offset=tuple(map(Spread, offset.tolist())),
            sensor_gain=tuple(map(Spread, gain.tolist())),
            sensor_noise=Spread(noise),
            motor_gain=Spread(motor),
            latency_steps=Spread(latency),
        )
        found = of_pole(gap, genomes=int(rng.integers(4, 20)), seed=seed)
        quantities = [*found.sensor_offset, *found.sensor_gain, *found.motor_gain, found.latency_steps]
        truths = [*offset, *gain, motor, latency]
        held += [holds(one, truth) for one, truth in zip(quantities, truths, strict=True) if one.is_known]
    assert len(held) > 180
    assert np.mean(held) > 0.92


def test_motors_and_sensors_are_told_apart() -> None:
    gap = Gap(
        sensor_offset=(Spread(0.03), Spread(0.0), Spread(-0.01)),
        motor_gain=(Spread(0.8), Spread(1.0)),
        latency_steps=Spread(1),
    )
    robot = DifferentialDrive(DifferentialDriveConfig(n_sensors=3, motion_noise=0.0), gap=gap)
    found = estimated(
        robot, DifferentialDrive(DifferentialDriveConfig(n_sensors=3, motion_noise=0.0)), DRIVE, DRIVE_TASK, 8, 3
    )
    assert [one.value for one in found.motor_gain] == pytest.approx([0.8, 1.0], abs=0.02)
    assert found.latency_steps.value == 1
    assert found.sensor_offset[0].value == pytest.approx(0.03, abs=0.003)
    assert all(
        not one.is_known or holds(one, truth)
        for one, truth in zip(found.sensor_offset, (0.03, 0.0, -0.01), strict=True)
    )


def test_a_body_with_noise_of_its_own_is_estimated_with_wider_intervals() -> None:
    gap = Gap(motor_gain=(Spread(0.75), Spread(0.95)), sensor_noise=Spread(0.01))
    found = estimated(
        DifferentialDrive(DifferentialDriveConfig(n_sensors=3), gap=gap),
        DifferentialDrive(DifferentialDriveConfig(n_sensors=3)),
        DRIVE,
        DRIVE_TASK,
        4,
        1,
    )
    for one, truth in zip(found.motor_gain, (0.75, 0.95), strict=True):
        assert holds(one, truth)
        assert one.value == pytest.approx(truth, abs=0.06)
    assert holds(found.latency_steps, 0.0)
    assert found.sensor_noise.value == pytest.approx(0.01, abs=0.004)


def test_samples_beyond_the_sensors_range_draw_no_estimate_there() -> None:
    """A gain and a latency at which no sample was in range once fitted without any misfit."""
    gap = Gap(motor_gain=Spread(0.8), latency_steps=Spread(2))
    for seed in range(6):
        found = of_pole(gap, genomes=6, seed=seed)
        assert min(found.overlap) > 20
        assert holds(found.latency_steps, 2.0)
        assert holds(found.motor_gain[0], 0.8)


def flat(trace: Trace, value: int) -> Trace:
    return replace(trace, sensors=np.full_like(trace.sensors, value))


def test_what_the_trials_do_not_tell_is_not_identifiable() -> None:
    rng = np.random.default_rng(1)
    bits = rng.integers(0, 2, (6, POLE.genome_length), dtype=np.uint8)
    robot = CartPole(gap=Gap(motor_gain=Spread(0.8)))
    traces = BatchEvaluator(POLE, POLE_TASK, robot).trace(bits).traces
    assert traces is not None
    starts = np.tile(POLE_TASK.starts, (6, 1))
    two = CartPole().estimate_gap(starts[:2], traces[:2])
    assert {*two.sensor_offset, *two.motor_gain, two.latency_steps} == {NOT_IDENTIFIABLE}
    again = CartPole().estimate_gap(np.tile(starts[:1], (9, 1)), [traces[0]] * 9)
    assert again.trials == 1
    assert again.motor_gain == (NOT_IDENTIFIABLE,)
    saturated = CartPole().estimate_gap(starts, [flat(trace, 1023) for trace in traces])
    assert saturated.overlap == (0, 0)
    assert {*saturated.sensor_offset, *saturated.sensor_gain, *saturated.motor_gain} == {NOT_IDENTIFIABLE}
    assert saturated.latency_steps == NOT_IDENTIFIABLE


def test_motors_that_never_move_tell_nothing_of_gain_and_latency() -> None:
    bits = np.zeros((1, POLE.genome_length), np.uint8)
    rng = np.random.default_rng(3)
    robot = CartPole(gap=Gap(sensor_noise=Spread(0.01), motor_gain=Spread(0.8)))
    noise = rng.integers(0, 2**63, (8, 1), dtype=np.uint64)
    traces = BatchEvaluator(POLE, POLE_TASK, robot).trace(np.repeat(bits, 8, axis=0), noise).traces
    assert traces is not None
    still = [replace(trace, x=np.full_like(trace.x, 512)) for trace in traces]
    found = CartPole().estimate_gap(np.tile(POLE_TASK.starts, (8, 1)), still)
    assert found.motor_gain == (NOT_IDENTIFIABLE,)
    assert found.latency_steps == NOT_IDENTIFIABLE


def test_without_a_trace_of_more_than_two_steps_there_is_nothing_to_estimate() -> None:
    with pytest.raises(ValueError, match="more than 2 steps"):
        CartPole().estimate_gap(np.zeros((0, 4)), [])

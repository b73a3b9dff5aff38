"""What the shipped tasks are worth, against their formulas in plain Python; and golden runs of every configuration."""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.config import load_config, parse_config
from sceann_hil.errors import ConfigError
from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.tasks.avoidance import AvoidanceConfig
from sceann_hil.tasks.line_following import LineFollowingConfig
from sceann_hil.tasks.phototaxis import PhototaxisConfig
from sceann_hil.tasks.starts import as_rows, instruction
from sceann_hil.tasks.wall_following import WallFollowingConfig
from sceann_hil.tasks.wheels import DrivingTask
from tests.runs import evolve

CONFIGS = Path(__file__).parents[2] / "configs" / "tasks"
Formula = Callable[[np.ndarray, np.ndarray], float]


def avoidance(s: np.ndarray, m: np.ndarray) -> float:
    left, right = 2 * m - 1
    return float(max((left + right) / 2, 0) * (1 - np.sqrt(abs(left - right) / 2)) * (1 - s.max()))


def phototaxis(s: np.ndarray, m: np.ndarray) -> float:
    return float(s.max())


def line_following(s: np.ndarray, m: np.ndarray) -> float:
    return float(max(m.sum() - 1, 0) * (1 - s.min()))


def wall_following(s: np.ndarray, m: np.ndarray) -> float:
    return float(max(m.sum() - 1, 0) * max(1 - abs(s[0] - 0.5) / 0.5, 0) * (1 - s[2]))


@pytest.mark.parametrize("formula", [avoidance, phototaxis, line_following, wall_following])
def test_fitness_is_the_mean_of_the_formula_over_the_steps(formula: Formula) -> None:
    config = load_config(CONFIGS / f"{formula.__name__}.yaml")
    rng = np.random.default_rng(5)
    with config.robot.build() as robot:
        batch = BatchEvaluator.of(config, robot)
        for genome in rng.integers(0, 2, (4, config.genome_length), dtype=np.uint8):
            results = batch.trace(genome[None], rng.integers(0, 2**63, batch.task.n_trials).astype(np.uint64))
            fitness = batch.task.fitness(results)
            for trace, value in zip(results.traces or (), fitness, strict=True):
                sensors, motors = trace.sensors / SENSOR_MAX, trace.x[:, -2:] / ONE
                steps = [formula(s, m) for s, m in zip(sensors, motors, strict=True)]
                assert value == pytest.approx(np.mean(steps), abs=1e-12)


@pytest.mark.parametrize(
    ("name", "golden"),
    [
        ("avoidance", "23dfd0a4356003f9"),
        ("phototaxis", "730ded3145df2ac2"),
        ("line_following", "d23ee62fd1c9d9d6"),
        ("wall_following", "80081c27fc43ed4e"),
        ("homing", "46a2c9e5e62f0396"),
    ],
)
def test_golden_run(name: str, golden: str, tmp_path: Path) -> None:
    text = (CONFIGS / f"{name}.yaml").read_text(encoding="utf-8")
    evolve(tmp_path / "run", text, "algorithm.population=12", "algorithm.generations=4")
    with closing(sqlite3.connect(tmp_path / "run" / "journal.sqlite")) as database:
        query = "SELECT individual, trial, fitness, steps, end_reason, state_hash FROM attempt ORDER BY id"
        attempts = database.execute(query).fetchall()
    assert len(attempts) == 5 * 12 * 4
    assert hashlib.sha256(repr(attempts).encode()).hexdigest()[:16] == golden


def test_a_start_in_an_obstacle_is_refused_with_its_place() -> None:
    text = (CONFIGS / "avoidance.yaml").read_text(encoding="utf-8")
    with pytest.raises(ConfigError, match=r"starts\[0\]: expected a free place, got \[0.5, 0.45\], where world.obs"):
        parse_config(text, "test", ["task.starts=[[0.5, 0.45, 0]]"])
    with pytest.raises(ConfigError, match=r"starts\[1\]: expected x in 0.0275..0.9725 m"):
        parse_config(text, "test", ["task.starts=[[0.5, 0.1, 0], [0.99, 0.1, 0]]"])


def test_a_sensor_that_the_robot_lacks_is_refused() -> None:
    text = (CONFIGS / "phototaxis.yaml").read_text(encoding="utf-8")
    with pytest.raises(ConfigError, match=r"light_sensors.*: expected numbers of the robot's 5 sensors, 0..4, got 5"):
        parse_config(text, "test", ["task.light_sensors=[0, 5]"])


def test_another_robot_is_refused() -> None:
    text = (CONFIGS / "homing.yaml").read_text(encoding="utf-8")
    with pytest.raises(ConfigError, match="starts its trials from"):
        parse_config(text, "test", ["robot={type: cartpole}"])


@pytest.mark.parametrize(
    ("config", "sensors", "worth"),
    [
        (AvoidanceConfig(distance_sensors=(1,)), [1.0, 0.25], 0.75),
        (PhototaxisConfig(light_sensors=(1,)), [1.0, 0.25], 0.25),
        (LineFollowingConfig(ground_sensors=(1,)), [0.0, 0.25], 0.75),
        (WallFollowingConfig(side_sensor=1, keep=0.25), [1.0, 0.25], 1.0),
        (WallFollowingConfig(side_sensor=1, keep=0.25, front_sensors=(0,)), [0.25, 0.25], 0.75),
    ],
)
def test_only_the_sensors_that_are_named_count(
    config: AvoidanceConfig | PhototaxisConfig | LineFollowingConfig | WallFollowingConfig,
    sensors: list[float],
    worth: float,
) -> None:
    assert config.value()(np.array(sensors), np.array([1.0, 1.0]), np.zeros(0)) == pytest.approx(worth)


def test_backwards_counts_where_the_task_says_so() -> None:
    back, free = np.zeros(2), np.zeros(3)
    assert AvoidanceConfig().value()(free, back, np.zeros(0)) == 0.0
    assert AvoidanceConfig(backwards_counts=True).value()(free, back, np.zeros(0)) == 1.0


@pytest.mark.parametrize("task", [AvoidanceConfig, LineFollowingConfig, WallFollowingConfig])
def test_a_robot_that_knows_no_backwards_stands_at_zero(task: type[DrivingTask]) -> None:
    sensors = np.array([0.5, 0.5]) if task is WallFollowingConfig else np.zeros(2)
    for forwards_only, speeds in ((False, [0.0, 0.0, 0.5, 1.0]), (True, [0.0, 0.5, 0.75, 1.0])):
        value = task(forwards_only=forwards_only).value()  # type: ignore[call-arg]
        driven = [value(sensors, np.full(2, motor), np.zeros(0)) for motor in (0.0, 0.5, 0.75, 1.0)]
        assert driven == pytest.approx(speeds)


def test_a_trial_that_a_wall_ends_gets_nothing_for_the_time_it_lacks() -> None:
    text = (CONFIGS / "avoidance.yaml").read_text(encoding="utf-8")
    settings = ["task.starts=[[0.9, 0.2, 0], [0.1, 0.2, 180]]", "robot.world.bump=end"]
    both = [parse_config(text, "test", [*settings, f"task.whole_trials={whole}"]) for whole in ("false", "true")]
    genome = np.ones((1, both[0].genome_length), np.uint8)
    fitness = []
    for config in both:
        with config.robot.build() as robot:
            batch = BatchEvaluator.of(config, robot)
            results = batch.trace(genome, np.arange(2, dtype=np.uint64))
            fitness.append(batch.task.fitness(results))
    assert (results.steps < batch.task.max_steps).any()
    assert fitness[1] == pytest.approx(fitness[0] * results.steps / batch.task.max_steps)


def test_starts_are_metres_and_degrees() -> None:
    assert as_rows(((0.1, 0.2, 270.0),)).tolist() == [[0.1, 0.2, pytest.approx(-np.pi / 2)]]
    assert "10.0 cm from the left and 20.0 cm from the lower wall, heading 270°" in instruction((0.1, 0.2, 270.0))

"""Obstacles that stand somewhere else in every trial: where they may, what feels them, and the same bits again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from backends.diffdrive import DifferentialDriveConfig
from backends.simulation.stepwise import StepwiseBody
from backends.world.body import WorldDrive
from backends.world.layout import Box, Round, World
from sceann_hil.config import ExperimentConfig
from sceann_hil.errors import ConfigError
from sceann_hil.journal import JournalReader
from sceann_hil.robot import Results
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.run.replay import replay
from sceann_hil.supervision.operators.web.pose import draw_pose
from tests.backends.world.test_world import inside, marched
from tests.runs import config_of, evolve

CONFIG = """
name: drawn
task: {type: avoidance, max_steps: 60, starts: [[0.2, 0.2, 45], [0.8, 0.2, 130]]}
robot:
  type: diffdrive
  arena_m: [1.0, 0.8]
  motion_noise: 0.05
  world:
    obstacles:
      - {drawn: {x_m: [0.2, 0.8], y_m: [0.2, 0.6], angle_deg: [0, 350]}, size_m: [0.2, 0.1]}
      - {at_m: [0.5, 0.4], radius_m: 0.05}
      - {drawn: {x_m: [0.1, 0.9], y_m: [0.1, 0.7]}, radius_m: 0.08}
    infrared: [{direction_deg: 30, range_m: 0.2}, {direction_deg: -30, range_m: 0.2}]
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 6, generations: 1}
"""


@pytest.fixture
def config() -> ExperimentConfig:
    return config_of(CONFIG)


def _traced(config: ExperimentConfig, n: int = 30) -> tuple[WorldDrive, Results]:
    robot = config.robot.build()
    assert isinstance(robot, WorldDrive)
    batch = BatchEvaluator.of(config, robot)
    genomes = np.random.default_rng(3).integers(0, 2, (n, config.genome_length), dtype=np.uint8)
    return robot, batch.trace(genomes, np.arange(n * 2, dtype=np.uint64).reshape(n, 2))


def _world(robot: WorldDrive, state: np.ndarray) -> World:
    """The trial's world with its obstacles where its state has them."""
    fields = dict(zip(robot.spec.state_fields, state.astype(float).tolist(), strict=True))
    box = Box((fields["obstacle0_x_m"], fields["obstacle0_y_m"]), (0.2, 0.1), fields["obstacle0_rad"])
    rounds = (*robot.world.rounds, Round((fields["obstacle2_x_m"], fields["obstacle2_y_m"]), 0.08))
    return World(robot.world.arena_m, rounds=rounds, boxes=(box,))


def test_each_trial_has_places_of_its_own_and_the_body_feels_and_meets_them(config: ExperimentConfig) -> None:
    robot, results = _traced(config)
    assert results.traces is not None
    places = np.stack([trace.state[0, 3:] for trace in results.traces])
    assert len(np.unique(places, axis=0)) == len(places)
    errors, touched = [], 0
    for trace in results.traces[::3]:
        assert (trace.state[:, 3:] == trace.state[0, 3:]).all()
        world = _world(robot, trace.state[0])
        x, y = trace.state[:, 0].astype(float), trace.state[:, 1].astype(float)
        assert not inside(world, x, y, robot.motion.radius_m - 1e-5).any()
        drawn = World((9.0, 9.0), rounds=world.rounds[1:], boxes=world.boxes)
        touched += int(inside(drawn, x, y, robot.motion.radius_m + 1e-5).any())
        for number, sensor in enumerate(robot.senses.infrared):
            reading = 1.0 - marched(world, sensor, trace.state[:-1].astype(float)) / sensor.range_m
            errors.append(np.abs(trace.sensors[:, number] / 1023.0 - reading))
    assert np.mean(np.concatenate(errors) > 3e-3) < 0.01
    assert touched > 2


def test_no_trial_begins_inside_an_obstacle_or_with_a_hidden_target() -> None:
    text = CONFIG.replace("  world:\n", "  target_m: [0.5, 0.6]\n  world:\n    target: hidden\n")
    robot, _ = _traced(config_of(text), 1)
    starts = np.tile([[0.2, 0.2, 0.0], [0.8, 0.2, 1.0]], (1000, 1))
    states = robot.states_of(starts, np.arange(2000, dtype=np.uint64))
    for start, state in zip(starts, states, strict=True):
        world = _world(robot, state)
        drawn = World((9.0, 9.0), rounds=world.rounds[1:], boxes=world.boxes)
        assert not inside(drawn, start[:1], start[1:2], robot.motion.radius_m).any()
        assert not inside(drawn, np.array([0.5]), np.array([0.6]), robot.world.goal_radius_m - 1e-9).any()


def test_a_trial_has_the_same_bits_alone_in_a_batch_and_one_tick_at_a_time(config: ExperimentConfig) -> None:
    robot, results = _traced(config, 3)
    batch = BatchEvaluator.of(config, robot)
    genomes = np.random.default_rng(3).integers(0, 2, (3, config.genome_length), dtype=np.uint8)
    alone = batch.trace(genomes[1:2], np.array([[2, 3]], np.uint64))
    assert results.traces is not None
    assert alone.traces is not None
    assert alone.traces[1].state.tobytes() == results.traces[3].state.tobytes()
    trace, body = results.traces[3], StepwiseBody(robot)
    body.reset(batch.task.starts[1], np.uint64(3))
    for step in range(len(trace.sensors)):
        assert body.sense().tolist() == trace.sensors[step].tolist()
        body.move(trace.x[step, -2:].tolist())
        assert body.state.tobytes() == trace.state[step + 1].tobytes()


def test_places_are_journalled_and_replayed_to_the_bit(tmp_path: Path, config: ExperimentConfig) -> None:
    evolve(tmp_path / "run", CONFIG)
    reader = JournalReader(tmp_path / "run")
    generations = [reader.attempts(number) for number in range(2)]
    rows = [row for generation in generations for row in generation]
    states = {tuple(row.final_state[3:]) for row in rows if row.final_state}
    assert len(states) == len(rows)
    with config.robot.build() as robot:
        compared = [trial for generation in generations for trial in replay(reader, config, robot, generation)]
    reader.close()
    assert all(one.equal for trial in compared for one in trial)


def test_equal_genomes_need_not_do_the_same(config: ExperimentConfig) -> None:
    assert not config_of(CONFIG.replace("motion_noise: 0.05", "motion_noise: 0.0")).robot.spec.noise_free
    drawing = config.robot.build().drawing
    assert drawing is not None
    drawing.check(config.robot.spec.state_fields)


def test_a_start_pose_shows_drawn_obstacles_only_where_they_are_known(config: ExperimentConfig) -> None:
    drawing = config.robot.build().drawing
    start = {"x_m": 0.2, "y_m": 0.2, "heading_rad": 0.5}
    known = {"obstacle0_x_m": 0.5, "obstacle0_y_m": 0.5, "obstacle0_rad": 0.2}
    without = draw_pose(drawing, start).count("<polygon")
    assert draw_pose(drawing, {**start, **known}).count("<polygon") == without + 1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("drawn: {x_m: [0.8, 0.2], y_m: [0.2, 0.6]}", r"x_m: expected the smaller value first, got \[0.8, 0.2\]"),
        ("drawn: {x_m: [0.2, 1.8], y_m: [0.2, 0.6]}", r"world.obstacles: expected a point in the arena"),
        ("drawn: {x_m: [0.1, 0.9], y_m: [0.1, 0.7]}, at_m: [0.1, 0.1]", "expected either at_m or drawn"),
        ("drawn: {x_m: [0.1, 0.9], y_m: [0.1, 0.7], angle_deg: [0, 9]}", "a round one cannot be turned"),
        (
            "drawn: {x_m: [0.19, 0.21], y_m: [0.19, 0.21]}",
            r"starts\[0\]: expected a free place, got \[0.2, 0.2\], where world.obstacles\[2\] would stand",
        ),
    ],
)
def test_places_that_cannot_be_are_refused(change: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        config_of(CONFIG.replace("drawn: {x_m: [0.1, 0.9], y_m: [0.1, 0.7]}", change))


def test_an_obstacle_over_the_target_is_refused() -> None:
    with pytest.raises(ValueError, match=r"expected the target at \[0.55, 0.55\] outside of obstacles"):
        _ = DifferentialDriveConfig.model_validate_json(
            '{"world": {"target": "hidden", "infrared": [{"direction_deg": 0}],'
            ' "obstacles": [{"at_m": [0.5, 0.5], "radius_m": 0.3}]}}'
        ).spec

"""Starts that are drawn for every trial: from its key alone, in free places, journalled and replayed to the bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sceann_hil.config import ExperimentConfig, dump_config, parse_config
from sceann_hil.errors import ConfigError
from sceann_hil.journal import JournalReader
from sceann_hil.plugins import RobotConfig, TaskConfig
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.run.experiment import Experiment
from sceann_hil.run.replay import replay
from sceann_hil.seeds import Purpose, keys
from sceann_hil.study import Block, compute_block
from sceann_hil.testing import TaskConformance

CONFIG = """
seed: 4
task:
  type: avoidance
  max_steps: 40
  starts: [[0.2, 0.2, 0.0], [0.2, 0.2, 90.0], [0.2, 0.2, 180.0]]
  starts_drawn: {x_m: [0.1, 0.9], y_m: [0.1, 0.7]}
robot:
  type: diffdrive
  arena_m: [1.0, 0.8]
  motion_noise: 0.0
  world:
    infrared: [{direction_deg: 30, range_m: 0.2}, {direction_deg: -30, range_m: 0.2}]
    obstacles: [{at_m: [0.5, 0.4], radius_m: 0.2}]
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 8, generations: 3}
"""
HOMING = ("task.type=homing", "robot.world.lamps=[{at_m: [0.5, 0.4]}]", "robot.world.obstacles=[]")


def config_of(*changes: str) -> ExperimentConfig:
    return parse_config(CONFIG, "test", changes)


def starts_of(config: ExperimentConfig, noise: Any, trial: Any) -> Any:
    return config.build_task().starts_of(np.asarray(trial), np.asarray(noise, np.uint64))


@pytest.mark.parametrize("changes", [(), HOMING])
def test_places_are_free_and_fill_the_ranges(changes: tuple[str, ...]) -> None:
    config = config_of(*changes)
    starts = starts_of(config, np.arange(2000), np.zeros(2000, int))
    names = ("x_m", "y_m", "heading_rad")
    assert not any(config.robot.refuses_start(dict(zip(names, row, strict=True))) for row in starts.tolist())
    assert starts.min(axis=0) == pytest.approx([0.1, 0.1, -np.pi], abs=0.02)
    assert starts.max(axis=0) == pytest.approx([0.9, 0.7, np.pi], abs=0.02)
    # evenly: as many on one side of the middle as on the other, within four standard deviations
    assert (abs((starts > [0.5, 0.4, 0.0]).mean(axis=0) - 0.5) < 4 * 0.5 / np.sqrt(2000)).all()
    assert len(np.unique(starts[:, 0])) == 2000


def test_a_start_comes_from_the_trial_and_its_key_alone() -> None:
    config = config_of()
    trial, noise = np.arange(90) % 3, keys(1, Purpose.TRIAL, np.arange(90))
    together = starts_of(config, noise, trial)
    for i in (0, 40, 89):
        assert np.array_equal(starts_of(config, noise[i : i + 1], trial[i : i + 1])[0], together[i])
    assert len(np.unique(starts_of(config, [7, 7, 7], [0, 1, 2]), axis=0)) == 3


def test_a_run_journals_other_starts_for_every_trial_and_replays_them_to_the_bit(tmp_path: Path) -> None:
    config = config_of()
    assert config.robot.spec.noise_free
    with Experiment.create(config, tmp_path / "run") as experiment, config.robot.build() as robot:
        experiment.evolve(robot)
    reader = JournalReader(tmp_path / "run")
    generations = [reader.attempts(number) for number in range(4)]
    rows = [row for generation in generations for row in generation]
    with config.robot.build() as robot:
        compared = [trial for generation in generations for trial in replay(reader, config, robot, generation)]
    best = [row.best_fitness for row in reader.generations(finished=True)]
    reader.close()
    assert len(rows) == 4 * 8 * 3
    assert len({tuple(row.start) for row in rows}) == len(rows)
    assert all(one.equal for trial in compared for one in trial)
    # a study's run is the same run, though the body has no noise and a parent's fitness could be taken for its child's
    block = Block(0, 0, dump_config(config), (config.seed,))
    assert compute_block(block).best[0].tolist() == pytest.approx(best, abs=1e-6)


def test_equal_genomes_do_not_do_the_same() -> None:
    config = config_of()
    with config.robot.build() as robot:
        genomes = np.repeat(np.random.default_rng(3).integers(0, 2, (1, config.genome_length), np.uint8), 20, axis=0)
        noise = keys(1, Purpose.TRIAL, np.arange(20)[:, None], np.arange(3))
        evaluator = BatchEvaluator.of(config, robot)
        fitness = evaluator.evaluate(genomes, noise).fitness
        again = evaluator.evaluate(genomes[5:7], noise[5:7]).fitness
    assert np.ptp(fitness) > 0
    assert np.array_equal(again, fitness[5:7])


def test_goal_reach_and_the_pole_draw_their_starts_too() -> None:
    goal = config_of("task={type: goal_reach, max_steps: 40, starts_drawn: {x_m: [0.1, 0.9], y_m: [0.1, 0.7]}}")
    task = goal.build_task()
    assert task.draws_starts
    starts = task.starts_of(np.arange(200) % 8, np.arange(200, dtype=np.uint64))
    names = task.start_fields
    assert len(np.unique(starts, axis=0)) == 200
    assert not any(goal.robot.refuses_start(dict(zip(names, row, strict=True))) for row in starts.tolist())
    pole = config_of("task={type: pole_balancing, start_angle_drawn_deg: [-6, 6], trials: 3}", "robot={type: cartpole}")
    task = pole.build_task()
    noise = keys(1, Purpose.TRIAL, np.arange(100)[:, None], np.arange(3)).ravel()
    angles = np.rad2deg(task.starts_of(np.tile(np.arange(3), 100), noise)[:, 2])
    assert task.draws_starts
    assert task.n_trials == 3
    assert len(np.unique(angles)) == 300
    assert -6.0 <= angles.min() < -5.0 < 5.0 < angles.max() <= 6.0
    for wrong, message in (
        ("start_angle_drawn_deg: [6, -6]", "expected the smaller value first"),
        ("trials: 3", "without start_angle_drawn_deg they are all the same"),
    ):
        with pytest.raises(ConfigError, match=message):
            config_of(f"task={{type: pole_balancing, {wrong}}}", "robot={type: cartpole}")


def test_drawn_headings_can_be_turned_to_try_robustness_unless_all_are_drawn() -> None:
    assert config_of().task.other_starts() is None
    for kind in ("avoidance", "homing", "goal_reach"):
        drawn = "{x_m: [0.1, 0.9], y_m: [0.1, 0.2], heading_deg: [0, 90]}"
        config = config_of(f"task={{type: {kind}, starts_drawn: {drawn}}}", *HOMING[1:])
        variation = config.task.other_starts()
        assert variation is not None
        turned = config.with_changes({f"task.{key}": value for key, value in variation.changes[-1].items()})
        starts = turned.build_task().starts_of(np.zeros(50, np.int64), np.arange(50, dtype=np.uint64))
        assert np.rad2deg(starts[:, 2] % (2 * np.pi)).min() >= 90.0
    pole = config_of("task={type: pole_balancing, start_angle_drawn_deg: [-20, 6]}", "robot={type: cartpole}")
    variation = pole.task.other_starts()
    assert variation is not None
    assert variation.changes[-1] == {"start_angle_drawn_deg": [-36.0, 18.0]}


def test_without_the_key_nothing_is_drawn() -> None:
    config = config_of("task.starts_drawn=null")
    task = config.build_task()
    assert not task.draws_starts
    assert np.array_equal(task.starts_of(np.array([1, 0]), np.zeros(2, np.uint64)), task.starts[[1, 0]])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (("robot.world.obstacles=[{at_m: [0.5, 0.4], radius_m: 0.45}]",), "at least 20% of the places to be free"),
        (("task.starts_drawn={x_m: [2.0, 3.0], y_m: [0.1, 0.7]}",), "got 0%"),
        (("task.starts_drawn={x_m: [0.9, 0.1], y_m: [0.1, 0.7]}",), "the smaller value first"),
        (("operator.who=[console]",), "expected a simulated robot and no operator"),
    ],
)
def test_what_cannot_be_drawn_is_refused_before_anything_runs(changes: tuple[str, ...], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        config_of(*changes)


def test_a_hundred_occupied_places_are_refused_in_words() -> None:
    config = config_of()
    drawn = config.task.starts_drawn.model_copy(update={"x_m": (0.5, 0.5), "y_m": (0.4, 0.4)})
    with pytest.raises(ConfigError, match=r"100 places were drawn .* where world.obstacles\[0\] stands"):
        drawn.draw(config.robot, np.zeros(2, np.int64), np.arange(2, dtype=np.uint64))


def test_a_task_that_draws_wants_its_robot() -> None:
    with pytest.raises(ValueError, match="expected build_for"):
        config_of().task.build()


class TestDrawnStarts(TaskConformance):
    def config(self) -> TaskConfig:
        return config_of().task

    def robot(self) -> RobotConfig:
        return config_of().robot

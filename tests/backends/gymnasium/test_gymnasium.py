"""Environments of others as our robots, and our robots as environments for others."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from backends.gymnasium import GymnasiumConfig
from backends.gymnasium.ours import SceannEnv
from backends.gymnasium.robot import GymnasiumRobot
from sceann_hil.config import ExperimentConfig, load_config, parse_config
from sceann_hil.errors import ConfigError
from sceann_hil.network.controller import ONE, Controller, quantise_sensors
from sceann_hil.plugins import RobotConfig
from sceann_hil.robot import EndReason
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.testing import RobotConformance

CONFIGS = Path(__file__).parents[3] / "configs"
CARTPOLE: dict[str, Any] = {
    "env": "CartPole-v1",
    "sensors": [{"observation": 0, "at_0": -2.4, "at_1": 2.4}, {"observation": 2, "at_0": -0.21, "at_1": 0.21}],
}


def section(**changes: Any) -> GymnasiumConfig:
    return GymnasiumConfig.model_validate(CARTPOLE | changes, strict=False)


class TestCartPole(RobotConformance):
    def config(self) -> RobotConfig:
        return section()


class TestMuJoCo(RobotConformance):
    def config(self) -> RobotConfig:
        return load_config(CONFIGS / "gymnasium" / "inverted_pendulum.yaml").robot


@pytest.mark.parametrize("name", ["cartpole", "inverted_pendulum"])
def test_a_trial_is_the_bare_environments_episode(name: str) -> None:
    """Stepped by hand with the reference controller: the same steps, observations and return."""
    config = load_config(CONFIGS / "gymnasium" / f"{name}.yaml")
    robot_config: Any = config.robot
    bare = gymnasium.make(robot_config.env).unwrapped
    low, high = np.array([(it.at_0, it.at_1) for it in robot_config.sensors]).T
    genome = np.random.default_rng(3).integers(0, 2, config.genome_length, dtype=np.uint8)
    weights = config.controller.coding.decode(genome[None], config.size)[0]
    with config.robot.build() as robot:
        batch = BatchEvaluator.of(config, robot)
        results = batch.trace(genome[None], np.zeros(batch.task.n_trials, np.uint64))
        fitness = batch.task.fitness(results)
    assert results.traces is not None
    for trial, trace in enumerate(results.traces):
        controller = Controller(weights, config.size, config.controller.dynamics)
        observed, _ = bare.reset(seed=trial)
        total = 0.0
        for step in range(int(results.steps[trial])):
            assert np.array_equal(np.float32(observed), trace.state[step])
            motors = controller.step(quantise_sensors(observed * (1.0 / (high - low)) - low / (high - low))) / ONE
            action: Any = int(motors[0] >= 0.5) if name == "cartpole" else np.float32(-3.0 + 6.0 * motors)
            observed, reward, terminated, _, _ = bare.step(action)
            total += float(reward)
        assert terminated == (results.end_reasons[trial] == EndReason.FELL)
        assert fitness[trial] == total


def test_evolution_on_it_finds_a_controller() -> None:
    config = load_config(CONFIGS / "gymnasium" / "cartpole.yaml")
    rng = np.random.default_rng(1)
    with config.robot.build() as robot:
        batch = BatchEvaluator.of(config, robot)
        genomes = rng.integers(0, 2, (30, config.genome_length), dtype=np.uint8)
        fitness = [batch.task.fitness(batch.trace(g[None], np.zeros(4, np.uint64))).mean() for g in genomes]
    assert max(fitness) > 3 * np.median(fitness)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"env": "CartPool-v1"}, "env: CartPool-v1 cannot be made"),
        ({"options": {"wheels": 3}}, "env: CartPole-v1 cannot be made"),
        ({"env": "Blackjack-v1"}, "env: expected an observation that is a row of numbers"),
        ({"sensors": [{"observation": 4}]}, "sensors[0].observation: expected 0..3, got 4"),
        ({"sensors": [{"observation": 1}]}, "sensors[0]: expected different finite at_0 and at_1, got -inf and inf"),
        ({"motors": [{"at_0": 0.0, "at_1": 1.0}]}, "motors: expected none, because the action is a choice, got 1"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_runs(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match="validation error") as error:
        section(**changes)
    assert message in str(error.value)


def test_the_message_comes_with_its_line() -> None:
    text = (CONFIGS / "gymnasium" / "cartpole.yaml").read_text(encoding="utf-8")
    with pytest.raises(ConfigError, match=r"robot.env.*CartPool-v1 cannot be made"):
        parse_config(text, "test", ["robot.env=CartPool-v1"])


def test_an_observation_that_is_no_number_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    config = load_config(CONFIGS / "gymnasium" / "cartpole.yaml")
    genome = np.zeros(config.genome_length, np.uint8)
    robot = config.robot.build()
    assert isinstance(robot, GymnasiumRobot)
    with robot:
        monkeypatch.setattr(robot, "sense", lambda: np.array([np.nan, 0.0, 0.0, 0.0]))
        batch = BatchEvaluator.of(config, robot)
        weights = batch.phenotype.coding.decode(genome[None], batch.phenotype.size)
        results = robot.run(batch.task.trials(batch.phenotype, weights, 0, 0, np.uint64(0)))
    assert EndReason(results.end_reasons[0]) is EndReason.FAULT
    assert "expected 4 finite values, got [nan" in results.why_void


OURS = [
    pytest.param("{type: pole_balancing, max_steps: 300}", "{type: cartpole, n_sensors: 4}", id="pole"),
    pytest.param("{type: goal_reach, max_steps: 60}", "{type: diffdrive, n_sensors: 3}", id="goal"),
    pytest.param(
        "{type: avoidance, max_steps: 60}",
        "{type: diffdrive, arena_m: [1, 1], world: {infrared: [{direction_deg: 30}, {direction_deg: -30}]}}",
        id="avoidance",
    ),
]


def ours(task: str, robot: str, *changes: str) -> ExperimentConfig:
    rest = "controller: {coding: sceann3, n_hidden: 1}\nalgorithm: {type: sga}\n"
    return parse_config(f"task: {task}\nrobot: {robot}\n{rest}", "test", changes)


@pytest.mark.parametrize(("task", "robot"), OURS)
def test_our_bodies_are_environments(task: str, robot: str) -> None:
    env = SceannEnv(ours(task, robot))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(env, skip_render_check=True)


@pytest.mark.parametrize(("task", "robot"), OURS)
def test_an_episode_of_ours_adds_up_to_the_fitness_of_the_trial(task: str, robot: str) -> None:
    config = ours(task, robot, *(["robot.motion_noise=0"] if "diffdrive" in robot else []))
    env = SceannEnv(config)
    genome = np.random.default_rng(8).integers(0, 2, config.genome_length, dtype=np.uint8)
    weights = config.controller.coding.decode(genome[None], config.size)[0]
    with config.robot.build() as body:
        batch = BatchEvaluator.of(config, body)
        results = batch.trace(genome[None], np.zeros(batch.task.n_trials, np.uint64))
        fitness = batch.task.fitness(results)
    for trial in range(batch.task.n_trials):
        controller = Controller(weights, config.size, config.controller.dynamics)
        observed, _ = env.reset(seed=0, options={"trial": trial})
        total, over, steps = 0.0, False, 0
        while not over:
            motors = controller.step(np.rint(observed * 1023).astype(np.uint16)) / ONE
            observed, reward, terminated, truncated, _ = env.step(motors.astype(np.float32))
            total, over, steps = total + reward, terminated or truncated, steps + 1
        assert steps == results.steps[trial]
        mean = "avoidance" in task
        assert total / (steps if mean else 1) == pytest.approx(fitness[trial], abs=1e-6)

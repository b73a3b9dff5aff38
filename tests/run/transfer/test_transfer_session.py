"""From a robot's file and runs to a transfer, to its conclusion, and on from there."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.config import ExperimentConfig, dump_config, parse_config
from sceann_hil.errors import ConfigError, NotARun
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.run.transfer.again import read_transfer, resemblance
from sceann_hil.run.transfer.ensemble import Ensemble
from sceann_hil.run.transfer.model import Observations
from sceann_hil.run.transfer.robots import DrawnRobots
from sceann_hil.run.transfer.session import transfer_config
from sceann_hil.run.transfer.state import Verdict
from sceann_hil.study.transfer import conclude


@pytest.fixture
def source(small: ExperimentConfig, tmp_path: Path) -> Path:
    """A finished run in the ideal body."""
    config = small.with_changes(
        {
            "algorithm": {"type": "sga", "population": 10, "generations": 3},
            "robot": {"type": "diffdrive", "n_sensors": 3},
        }
    )
    run(config, tmp_path / "source")
    return tmp_path / "source"


@pytest.fixture
def robot(tmp_path: Path) -> Path:
    path = tmp_path / "robot.yaml"
    path.write_text("robot: {type: diffdrive, n_sensors: 3, gap: {motor_gain: [0.7, 1.0]}}\n", encoding="utf-8")
    return path


def run(config: ExperimentConfig, directory: Path) -> Outcome:
    with Experiment.create(config, directory) as experiment, config.robot.build() as robot:
        return experiment.evolve(robot)


def test_a_file_with_a_robot_only_takes_the_rest_from_the_run(source: Path, robot: Path) -> None:
    config = transfer_config(robot, [source], trials=9, rounds=1)
    assert config.task.model_dump()["headings_deg"] == (0.0, 90.0, 180.0)
    assert config.robot.model_dump()["gap"]["motor_gain"] == (0.7, 1.0)
    assert config.algorithm.generations == 9
    body = config.uncertainty.body
    assert body is not None
    assert body.model_dump()["gap"]["motor_gain"] == 1.0
    assert parse_config(dump_config(config), "again") == config


def test_without_a_run_such_a_file_is_refused(robot: Path) -> None:
    with pytest.raises(ConfigError, match="whole experiment"):
        transfer_config(robot)


def test_candidates_of_another_controller_are_refused(small: ExperimentConfig, source: Path, tmp_path: Path) -> None:
    path = tmp_path / "other.yaml"
    path.write_text(dump_config(small.with_changes({"controller.n_hidden": 2})), encoding="utf-8")
    config = transfer_config(path, [source])
    with pytest.raises(ConfigError, match="n_hidden: expected 2, as this experiment has it, got 1"):
        run(config, tmp_path / "out")


def test_the_conclusion_and_a_further_transfer(source: Path, robot: Path, tmp_path: Path) -> None:
    config = transfer_config(robot, [source], trials=5, rounds=1, settings=["uncertainty.robots=20"])
    assert run(config, tmp_path / "first") is Outcome.FINISHED
    told = conclude(tmp_path / "first")
    document = json.loads((tmp_path / "first" / "transfer" / "transfer.json").read_text(encoding="utf-8"))
    assert document == json.loads(json.dumps(told.document))
    assert document["trials"] == 5
    assert document["measured"]["trials"] == 3
    assert any(line.startswith("Measured on 3 fresh trials") for line in told.lines)
    assert (tmp_path / "first" / "transfer" / "report.html").stat().st_size > 10_000
    written = (tmp_path / "first" / "transfer" / "robot.yaml").read_text(encoding="utf-8")
    assert "motor_gain" in written

    further = transfer_config(
        robot, (), trials=4, evolve=1, again=tmp_path / "first", settings=["uncertainty.robots=20"]
    )
    assert run(further, tmp_path / "second") is Outcome.FINISHED
    before, _ = read_transfer(tmp_path / "first")
    after, _ = read_transfer(tmp_path / "second")
    assert after.inherited == 5
    assert len(after.observed) == 9
    assert after.observed.value[:5].tolist() == before.observed.value.tolist()
    same = (after.candidates[after.observed.candidate[:5]] == before.candidates[before.observed.candidate]).all()
    assert same


def test_when_nobody_succeeds_it_says_so_and_claims_nothing(small: ExperimentConfig, tmp_path: Path) -> None:
    config = small.with_changes(
        {
            "task": {"type": "goal_reach", "headings_deg": [0.0, 90.0], "max_steps": 45},
            "algorithm": {"type": "transfer", "trials": 20, "evolve": 1, "candidates": 30},
        }
    )
    run(config, tmp_path / "hopeless")
    state, _ = read_transfer(tmp_path / "hopeless")
    assert state.verdict is Verdict.NONE_SUCCEEDS
    assert len(state.observed) < 20
    told = "\n".join(conclude(tmp_path / "hopeless").lines)
    assert "No candidate is expected to succeed on this robot" in told
    assert "What would help" in told
    assert "Recommended" not in told


SIMULATED = "type: pole_balancing, max_steps: 50"
OTHER_TASK = """
task: {{type: episode_return, max_steps: 50, seeds: [0, 1, 2], worst: 0, best: {best}}}
robot: {{type: gymnasium, env: CartPole-v1, sensors: [{{observation: 0}}, {{observation: 2}}]}}
controller: {{coding: sceann3, n_hidden: 1}}
algorithm: {{type: transfer, trials: 3, rounds: 1, evolve: 2, candidates: 20}}
uncertainty: {{robots: 20, body: {{type: cartpole}}, task: {{{task}}}}}
"""


def test_simulated_robots_with_a_task_of_their_own(tmp_path: Path) -> None:
    # Gymnasium's cart cannot begin like ours, and nobody here wrote it
    config = parse_config(OTHER_TASK.format(best=50, task=SIMULATED), "other")
    assert run(config, tmp_path / "run") is Outcome.FINISHED
    state, measured = read_transfer(tmp_path / "run")
    assert len(state.observed) == 3
    assert 0 < measured[-1] <= 50


@pytest.mark.parametrize(
    ("best", "task", "told"),
    [
        (60, SIMULATED, "expected fitness from 0 to 60, as on the robot, got 0 to 50"),
        (1, "type: avoidance", "cannot do task avoidance"),
    ],
)
def test_a_task_that_cannot_be_compared_is_refused(best: int, task: str, told: str) -> None:
    config = parse_config(OTHER_TASK.format(best=best, task=task), "other")
    with pytest.raises(ConfigError, match=told) as caught:
        config.algorithm.prepare(config)
    assert caught.value.hint.startswith("Nothing was started.")


def test_an_ensemble_in_which_everything_fails_is_refused(small: ExperimentConfig, tmp_path: Path) -> None:
    config = small.with_changes(
        {
            "task": {"type": "goal_reach", "headings_deg": [0.0, 90.0], "max_steps": 3},
            "algorithm": {"type": "transfer", "evolve": 1, "candidates": 30},
        }
    )
    with pytest.raises(
        ConfigError, match=r"Every candidate fails in every simulated robot: 1,200 trials, all of"
    ) as told:
        config.algorithm.prepare(config)
    assert told.value.hint.startswith("Nothing was started.")


def test_a_run_of_another_algorithm_is_no_transfer(source: Path) -> None:
    with pytest.raises(NotARun, match="algorithm sga"):
        conclude(source)


def test_a_robot_resembles_the_simulated_one_that_does_the_same() -> None:
    rng = np.random.default_rng(0)
    fitness = rng.random((30, 12, 2)).astype(np.float32)
    ensemble = Ensemble(fitness, np.ones((12, 2)), 0.01, None, DrawnRobots((), np.zeros((30, 0)), ()))
    k, h = np.arange(12), np.zeros(12, np.int64)
    weights = resemblance(ensemble, Observations.of(k, h, fitness[17, k, h].astype(np.float64)))
    assert weights.argmax() == 17
    assert weights.sum() == pytest.approx(1.0)


def test_a_success_in_the_very_last_step_does_not_hide_what_success_is() -> None:
    from sceann_hil.run.transfer.ensemble import _level

    def part(successes: int, above: int, least: float) -> dict[str, np.ndarray]:
        return {
            "fitness": np.zeros((1, 100, 100)),
            "n_successes": np.array(successes),
            "n_above": np.array(above),
            "least_above": np.array(least),
            "most_failure": np.array(0.0),
        }

    assert _level([part(0, 0, np.inf)], 1.0) == 1.0
    assert _level([part(3, 0, np.inf)], 1.0) == 1.0
    assert _level([part(1000, 990, 0.1)], 1.0) == 0.1
    assert _level([part(1000, 500, 0.1)], 1.0) is None

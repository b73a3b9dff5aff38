"""A fitness of one's own as a line of the configuration: what it is worth, and all that it may not say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sceann_hil.config import parse_config
from sceann_hil.errors import ConfigError, PluginError
from sceann_hil.run.batch import BatchEvaluator
from sceann_hil.tasks.formula import FormulaConfig, checked, value_of

TEXT = (Path(__file__).parents[2] / "configs" / "tasks" / "avoidance.yaml").read_text(encoding="utf-8")
AVOIDANCE = "speed * (1 - sqrt(0.5 * abs(left - right))) * (1 - nearest)"


@pytest.mark.parametrize(
    ("formula", "worth"),
    [
        ("speed", 0.25),
        ("left", 0.5),
        ("right", 0.0),
        ("1 - nearest", 0.2),
        ("sensors[1] if motors[0] > 0.5 else 0", 0.8),
        ("max(sensors[0], 0.3) ** 2 + min_of(sensors)", 0.09 + 0.1),
        ("speed > 0 and nearest < 0.9", 1.0),
        (" speed\n  + 1 ", 1.25),
    ],
)
def test_a_formula_is_worth_what_it_says(formula: str, worth: float) -> None:
    value = value_of(checked(formula), forwards_only=False)
    assert value(np.array([0.1, 0.8]), np.array([0.75, 0.5]), np.zeros(0)) == pytest.approx(worth)


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("spede", "got 'spede'"),
        ("speed +", "expected a formula"),
        ("speed.real", "got 'speed.real'"),
        ("__import__('os').system('ls')", "expected calls such as"),
        ("open('x')", "expected one of abs"),
        ("abs", "expected one of sensors"),
        ("'text'", "expected a number"),
        ("sensors[-1]", "expected a place"),
        ("sensors[0:2]", "expected a place"),
        ("[1, 2]", "expected numbers"),
        ("(lambda: 1)()", "expected calls such as"),
        ("9 ** 9 ** 9", "expected a power"),
        ("sqrt(speed, x=1)", "expected calls such as"),
        ("speed := 2", "expected a formula"),
        ("1 + " * 300 + "1", "at most 500 characters"),
        ("(" * 240 + "1" + ")" * 240, "expected a formula"),
    ],
)
def test_what_it_may_not_say_is_refused(formula: str, message: str) -> None:
    with pytest.raises(ValueError, match="expected") as refused:
        checked(formula)
    assert message in str(refused.value)


def test_a_sensor_that_the_robot_lacks_is_refused_with_its_key() -> None:
    with pytest.raises(ConfigError, match=r"task.step .*expected sensors\[0\] to sensors\[6\], got sensors\[7\]"):
        parse_config(TEXT, "test", ["task.type=formula", "task.step=sensors[7]"])


def test_a_formula_that_can_fail_is_refused_before_anything_runs() -> None:
    with pytest.raises(PluginError, match=r"formula \(task.step"):
        parse_config(TEXT, "test", ["task.type=formula", "task.step=1 / sensors[0]"])


def test_each_formula_gives_its_own_fitness_in_simulation() -> None:
    """The same bits as the task that says the same; another formula in the same process another fitness."""
    fitness = {}
    for name, changes in {
        "task": [],
        "formula": ["task.type=formula", f"task.step={AVOIDANCE}"],
        "other": ["task.type=formula", "task.step=speed"],
    }.items():
        config = parse_config(TEXT, "test", [*changes, "task.max_steps=40"])
        genomes = np.random.default_rng(3).integers(0, 2, (6, config.genome_length), dtype=np.uint8)
        with config.robot.build() as robot:
            batch = BatchEvaluator.of(config, robot)
            noise = np.arange(6 * batch.task.n_trials, dtype=np.uint64).reshape(6, -1)
            fitness[name] = batch.evaluate(genomes, noise).mean_fitness
    assert fitness["formula"] == pytest.approx(fitness["task"], abs=1e-12)
    assert not np.allclose(fitness["other"], fitness["task"])


def test_a_formula_has_no_bounds_that_racing_could_use() -> None:
    task = FormulaConfig(step="10 * speed").build()
    assert (task.best_fitness, task.worst_fitness) == (np.inf, -np.inf)

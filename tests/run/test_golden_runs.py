"""Seeded runs whose journals must never change: algorithm x task, to the last bit, on every machine."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from tests.runs import contents, evolve

POLE = """
task: {type: pole_balancing, max_steps: 1000}
robot: {type: cartpole, n_sensors: 2}
controller: {coding: sceann3, n_hidden: 3}
"""
GOAL = """
task: {type: goal_reach}
robot: {type: diffdrive, n_sensors: 5}
controller: {coding: sceann1, n_hidden: 2}
"""
SGA = "algorithm: {type: sga, generations: 12}"
OGA = "algorithm: {type: oga, generations: 12}"
GAP = "robot.gap={sensor_offset: {uniform: [-0.02, 0.02]}, sensor_noise: 0.01, motor_gain: 0.9, latency_steps: 1}"


@pytest.mark.parametrize(
    ("text", "overrides", "golden"),
    [
        pytest.param(POLE + SGA, (), "ab7e0be42a4e4311", id="sga pole"),
        pytest.param(POLE + OGA, (), "9f323401985e433e", id="oga pole"),
        pytest.param(GOAL + SGA, (), "ef5366c4e7bc48ac", id="sga goal"),
        pytest.param(GOAL + OGA, (), "ac3847096080e95d", id="oga goal"),
        pytest.param(GOAL + SGA, ("controller.neuron=memoryless",), "5c75ee3fa1838576", id="memoryless"),
        pytest.param(GOAL + SGA, (GAP,), "4c36e07fa8c6ccfc", id="gap"),
    ],
)
def test_golden_run(text: str, overrides: tuple[str, ...], golden: str, tmp_path: Path) -> None:
    evolve(tmp_path / "run", text, "seed=42", *overrides)
    journal = contents(tmp_path / "run")
    evaluated = [journal["individual"], [row[:-2] + row[-1:] for row in journal["attempt"]]]
    assert hashlib.sha256(repr(evaluated).encode()).hexdigest()[:16] == golden

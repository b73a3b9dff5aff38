"""A real robot's twin: what panel, console and viewer draw, and what stands in for it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from backends.diffdrive import DifferentialDriveConfig
from backends.remote import RemoteConfig
from sceann_hil import registry
from sceann_hil.network.coding import NetworkSize
from sceann_hil.recording import chunks, overview, scene
from sceann_hil.recording.source import RunSource
from sceann_hil.recording.trial import RecordedRun, RecordedTrial
from sceann_hil.registry import Group
from sceann_hil.robot import EndReason
from sceann_hil.robot.drawing import Drawing
from sceann_hil.robot.trials import Trace
from sceann_hil.supervision.operators.sketch import sketch
from sceann_hil.supervision.operators.web import draw_pose
from tests.runs import GOAL, evolve

TWIN = {"type": "diffdrive", "n_sensors": 2, "arena_m": [1.2, 0.8], "target_m": [1.1, 0.7]}
ROBOT: dict[str, Any] = {
    "type": "remote",
    "port": "/dev/ttyUSB0",
    "n_sensors": 2,
    "n_motors": 2,
    "tick_s": 0.1,
    "start_fields": ["x_m", "y_m", "heading_rad"],
    "twin": TWIN,
}
START = {"x_m": 0.1, "y_m": 0.12, "heading_rad": 0.785}


def config(**changes: Any) -> RemoteConfig:
    return RemoteConfig.model_validate_json(json.dumps({**ROBOT, **changes}))


def test_a_robot_with_a_twin_has_its_arena() -> None:
    robot = config().build()
    assert isinstance(robot.drawing, Drawing)
    assert robot.drawing.bounds_m[1] >= 1.2
    picture = draw_pose(robot.drawing, START)
    assert "goal" in picture
    drawn = sketch(robot.drawing, START)
    assert "G" in drawn
    assert "facing up and right" in drawn
    assert max(map(len, drawn.splitlines())) < 80
    assert drawn.count("\n") < 18
    assert config(twin=None).build().drawing is None
    assert sketch(None, START) == ""


def test_the_twin_stands_in_for_it() -> None:
    simulated = config().simulated
    assert simulated is not None
    assert simulated.type == "diffdrive"
    assert config(twin=None).simulated is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"n_sensors": 3}, "twin: expected the robot's n_sensors 3, got 2"),
        ({"n_motors": 1}, "twin: expected the robot's n_motors 1, got 2"),
        ({"start_fields": ["x_m"]}, "twin: expected the robot's start_fields"),
        ({"twin": {**TWIN, "arena_m": [-1, 1]}}, r"twin\.arena_m"),
        ({"twin": {"type": "no_such"}}, r"twin\.type"),
        ({"twin": {**ROBOT, "twin": None}}, "twin: expected a simulated robot, got remote"),
        ({"mode": "hil", "body": TWIN}, "twin: expected nothing here in mode hil"),
    ],
)
def test_a_twin_that_is_none_is_refused(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        config(**changes)


@pytest.mark.parametrize("robot", [TWIN, {"type": "cartpole"}], ids=["arena", "cart"])
def test_the_viewer_draws_the_start_and_invents_no_path(robot: dict[str, Any]) -> None:
    body = registry.load(Group.ROBOTS, robot["type"]).model_validate_json(json.dumps(robot)).build()
    run = RecordedRun(
        *("r", "e", "remote", NetworkSize(2, 1, 2), 0.1, 50, 1.0),
        state_fields=(),
        drawing=body.drawing,
        start_fields=("x_m", "y_m", "heading_rad"),
    )
    trace = Trace(
        np.zeros((6, 0), np.float32),
        np.ones((5, 2), np.uint16),
        np.zeros((5, 3), np.int16),
        np.zeros((5, 3), np.int16),
    )
    trial = RecordedTrial(
        *(1, 0, 0, 0, 0, 0.5, EndReason.GOAL, False),
        weights=np.zeros((3, 6), np.int8),
        trace=trace,
        start=tuple(START.values()),
    )
    paths = {str(chunk.entity_path) for chunk in chunks.trial_chunks(run, trial, full=True)}
    assert "/signals/sensors" in paths
    assert not {scene.PATH, scene.TRAIL} & paths
    assert ("/scene/robot" in paths) == (robot is TWIN)


def test_the_overview_of_a_robot_whose_path_nobody_knows_can_be_recorded(tmp_path: Path) -> None:
    """Regression: it ended with a KeyError, and the run's overview was missing."""
    path = tmp_path / "run"
    evolve(path, GOAL, "robot.n_sensors=2", "algorithm.generations=0", "task.max_steps=5")
    source = RunSource(path)
    drawing = DifferentialDriveConfig.model_validate_json(json.dumps(TWIN)).build().drawing
    run = replace(source.run, state_fields=(), drawing=drawing)
    paths = {str(chunk.entity_path) for chunk in overview.overview_generation(run, source.generation(0))}
    source.close()
    assert "/fitness/curve" in paths
    assert not {name for name in paths if name.endswith(("/paths", "/champion"))}

"""Names that people and rerun see."""

from __future__ import annotations

import pytest

from backends.cartpole import CartPole, CartPoleConfig
from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from sceann_hil.network.coding import NetworkSize
from sceann_hil.recording.trial import RecordedRun, as_id, recording_id
from sceann_hil.robot.drawing import Drawing


def run_with(drawing: Drawing | None, size: NetworkSize) -> RecordedRun:
    return RecordedRun("run", "experiment", "robot", size, 0.1, 100, 1.0, (), drawing)


def test_recording_id_names_run_generation_individual_and_trial() -> None:
    assert recording_id("maze-1", 7, 3, 5, 0) == "maze-1_g007_i03_t5"


def test_later_attempts_have_ids_of_their_own() -> None:
    assert recording_id("maze-1", 7, 3, 5, 1) == "maze-1_g007_i03_t5_a1"


@pytest.mark.parametrize(
    ("text", "expected"), [("goal reach", "goal-reach"), ("a.b/c", "a-b-c"), ("..", "run"), ("käfer", "k-fer")]
)
def test_ids_have_nothing_that_rerun_renames(text: str, expected: str) -> None:
    assert as_id(text) == expected


def test_arena_sensors_are_called_by_their_directions() -> None:
    assert run_with(
        DifferentialDrive(DifferentialDriveConfig(n_sensors=3, sensor_field_deg=90.0)).drawing, NetworkSize(3, 1, 2)
    ).sensor_names == (
        "-30°",
        "0°",
        "+30°",
    )


def test_cart_sensors_are_called_by_what_they_measure() -> None:
    run = run_with(CartPole(CartPoleConfig(n_sensors=4)).drawing, NetworkSize(4, 2, 1))
    assert run.sensor_names == ("x", "angle", "speed", "rate")
    assert run.motor_names == ("force",)


def test_unknown_robots_have_numbered_sensors_and_motors() -> None:
    run = run_with(None, NetworkSize(2, 1, 3))
    assert run.sensor_names == ("s1", "s2")
    assert run.motor_names == ("m1", "m2", "m3")

"""What the validated model tells the rest of the framework."""

from __future__ import annotations

import pickle
import subprocess
import sys

import pytest
from pydantic import ValidationError

from sceann_hil.config import parse_config
from sceann_hil.errors import ConfigError
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.plugins import Misfit, RobotConfig
from sceann_hil.robot import RobotSpec

pytestmark = pytest.mark.usefixtures("bench")

GOOD = """\
task: {type: reach}
robot: {type: rover, n_sensors: 7}
controller: {coding: sceann2, n_hidden: 2, neuron: memoryless, initial_output: 0.3}
algorithm: {type: climb}
"""


def test_sensors_and_motors_come_from_the_robot() -> None:
    config = parse_config(GOOD, "good")
    assert config.size == NetworkSize(7, 2, 2)
    assert config.genome_length == 2 * 4 * 11


def test_the_initial_output_becomes_the_nearest_q10_value() -> None:
    assert parse_config(GOOD, "good").controller.dynamics == Dynamics(Neuron.MEMORYLESS, 307)
    for value, q10 in [("0", 0), ("1", 1024), ("0.5", 512), ("0.00048828125", 1)]:
        config = parse_config(GOOD, "good", [f"controller.initial_output={value}"])
        assert config.controller.dynamics.initial_output == q10


def test_the_largest_network_is_accepted_and_one_more_source_is_not() -> None:
    assert parse_config(GOOD, "good", ["controller.n_hidden=14"]).size.n_sources == 23
    with pytest.raises(ConfigError, match="at most 23 sources"):
        parse_config(GOOD, "good", ["controller.n_hidden=15"])


def test_a_configuration_never_changes() -> None:
    config = parse_config(GOOD, "good")
    with pytest.raises(ValidationError, match="frozen"):
        config.seed = 3  # type: ignore[misc]
    assert hash(config) == hash(parse_config(GOOD, "good"))


def test_a_configuration_can_be_sent_to_another_process() -> None:
    config = parse_config(GOOD, "good")
    assert pickle.loads(pickle.dumps(config)) == config


def test_the_plugin_bases_import_nothing_of_the_framework() -> None:
    code = "import sys, sceann_hil.plugins; print(*sorted(m for m in sys.modules if m.startswith('sceann_hil')))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["sceann_hil", "sceann_hil.lazily", "sceann_hil.plugins"]


@pytest.mark.parametrize(
    ("error", "place", "message"),
    [
        (ValueError("n_sensors: expected fewer, got 7"), "good:2:33", "robot.n_sensors: expected fewer, got 7"),
        (ValueError("it is too wet"), "good:2:15", "robot.type: it is too wet"),
        (Misfit("it is too wet"), "good:2:15", "robot.type: it is too wet"),
        (Misfit("tick_s: expected less", "tick_s"), "good:2:1", "robot.tick_s: expected less"),
        (
            Misfit("too much", "n_sensors", "gap.latency_steps"),
            "good:2:33",
            "robot.n_sensors (line 2) and robot.gap.latency_steps (by default): too much",
        ),
    ],
)
def test_a_robot_that_cannot_be_is_refused_at_its_keys(
    error: ValueError, place: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import bench_plugins

    def spec(_robot: RobotConfig) -> RobotSpec:
        raise error

    monkeypatch.setattr(bench_plugins.RoverConfig, "spec", property(spec))
    with pytest.raises(ConfigError) as caught:
        parse_config(GOOD, "good")
    assert caught.value.message == f"{place}: {message}"

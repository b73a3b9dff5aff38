"""The example of a body outside the core: one short file that passes the kits, evolves and is drawn."""

from __future__ import annotations

import re
import textwrap
import tomllib
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from examples.line_follower import BEND_M, LINE_M, POSE, AlongConfig, LineFollowerConfig, sense
from sceann_hil.config import parse_config
from sceann_hil.journal import JournalReader
from sceann_hil.network.neurons import LANES
from sceann_hil.plugins import RobotConfig, TaskConfig
from sceann_hil.recording.chunks import shared_chunks, trial_chunks
from sceann_hil.recording.source import RunSource
from sceann_hil.robot import EndReason
from sceann_hil.run.experiment import Experiment
from sceann_hil.run.replay import replay
from sceann_hil.supervision.operators.web.pose import draw_pose
from sceann_hil.testing import BodyConformance, TaskConformance
from tests.installed import installed

ROOT = Path(__file__).parents[2]
EXAMPLE, GUIDE = ROOT / "examples" / "line_follower.py", ROOT / "docs" / "adding-a-body.md"
CONFIG = (ROOT / "examples" / "line_follower.yaml").read_text(encoding="utf-8")


class TestLineFollower(BodyConformance):
    def config(self) -> RobotConfig:
        return LineFollowerConfig()

    def start(self) -> tuple[float, ...]:
        return (0.0, -BEND_M, 0.0)


class TestAlong(TaskConformance):
    def config(self) -> TaskConfig:
        return AlongConfig()

    def robot(self) -> RobotConfig:
        return LineFollowerConfig()


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A finished run, as long as the example is installed."""
    folder = tmp_path_factory.mktemp("along")
    groups = tomllib.loads((ROOT / "examples" / "pyproject.toml").read_text(encoding="utf-8"))["project"][
        "entry-points"
    ]
    entries = "".join(
        f"[{group}]\n" + "".join(f"{name} = examples.{place}\n" for name, place in places.items())
        for group, places in groups.items()
    )
    with pytest.MonkeyPatch.context() as patch, installed(folder / "site", {"line_follower": entries}, patch):
        config = parse_config(CONFIG, "test")
        with Experiment.create(config, folder / "run") as experiment, config.robot.build() as robot:
            experiment.evolve(robot)
        yield folder / "run"


def test_it_is_one_short_file() -> None:
    assert len(EXAMPLE.read_text(encoding="utf-8").splitlines()) < 90


def test_the_guide_shows_the_example_s_own_picture() -> None:
    (shown,) = re.findall(r"^```py\n(.*?)^```$", GUIDE.read_text(encoding="utf-8"), re.M | re.S)
    assert textwrap.indent(shown, "    ") in EXAMPLE.read_text(encoding="utf-8")


def test_a_sensor_reads_how_far_it_is_from_the_line() -> None:
    state, sensors = np.zeros((3, LANES), np.float32), np.zeros((3, LANES), np.float32)
    off = np.linspace(0.0, 2.0 * LINE_M, LANES)
    # the middle sensor is `off` inside of the lower straight, the left one 2 cm further in
    state[1] = off - BEND_M
    sense(state, sensors, np.zeros((10, LANES), np.float32), np.zeros(1, np.float32))
    for sensor, place in zip(sensors, (off + 0.02, off, off - 0.02), strict=True):
        assert sensor == pytest.approx(np.clip(1.0 - np.abs(place) / LINE_M, 0.0, 1.0), abs=1e-5)


def test_it_learns_to_follow_the_line_and_every_trial_is_replayed_to_the_bit(run: Path) -> None:
    reader = JournalReader(run)
    config = parse_config(CONFIG, "test")
    best = [row.best_fitness or 0.0 for row in reader.generations(finished=True)]
    attempts = reader.attempts(10)
    with config.robot.build() as robot:
        compared = replay(reader, config, robot, attempts)
    first = {row.end_reason for row in reader.attempts(0)}
    reader.close()
    assert best[-1] > 2 * best[0]
    assert all(one.equal for trial in compared for one in trial)
    assert EndReason.OUT_OF_BOUNDS in first


def test_its_picture_follows_the_body(run: Path) -> None:
    robot = LineFollowerConfig().build()
    robot.drawing.check(robot.spec.state_fields)
    poses = [draw_pose(robot.drawing, dict(zip(POSE, start, strict=True))) for start in AlongConfig().build().starts]
    for pose in poses:
        ElementTree.fromstring(pose)
        assert "polyline" in pose
    assert len(set(poses)) == len(poses)

    source = RunSource(run)
    shown = source.generation(10).trials[0]
    drawn = {chunk.entity_path: chunk.to_record_batch() for chunk in trial_chunks(source.run, shown, full=True)}
    still = {chunk.entity_path for chunk in shared_chunks(source.run)}
    source.close()
    assert {"/scene/robot", "/signals/value", "/signals/worth", "/signals/sensors"} <= set(drawn)
    assert drawn["/scene/robot"].num_rows == shown.steps + 1
    assert "/scene/fixed/shape0" in still
    assert source.run.sensor_names == ("left", "middle", "right")

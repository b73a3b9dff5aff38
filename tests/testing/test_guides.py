"""The examples of the guides for tasks and bodies are whole, and pass their kits."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from rerun.chunk import Chunk

from backends.diffdrive import DifferentialDriveConfig
from sceann_hil.config import ExperimentConfig, dump_config, parse_config
from sceann_hil.journal import AttemptRow, JournalReader
from sceann_hil.plugins import RobotConfig, TaskConfig
from sceann_hil.recording.chunks import trial_chunks
from sceann_hil.recording.source import RunSource
from sceann_hil.run.experiment import Experiment
from sceann_hil.run.replay import replay, sessions_of_another_body
from sceann_hil.study import Block, compute_block
from sceann_hil.study.landscape import enumerate_landscape
from sceann_hil.study.robustness import measure
from sceann_hil.testing import BodyConformance, RobotConformance, TaskConformance
from tests.installed import installed

ROOT = Path(__file__).parents[2]


def _blocks(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```$", (ROOT / "docs" / page).read_text(encoding="utf-8"), re.M | re.S)


def _module(name: str, *blocks: str) -> ModuleType:
    module = sys.modules[name] = ModuleType(name)
    for block in blocks:
        exec(compile(block, name, "exec"), module.__dict__)
    return module


TASK_GUIDE, BODY_GUIDE = _blocks("adding-a-task.md"), _blocks("adding-a-body.md")
CLEARANCE = _module("of_the_task_guide", TASK_GUIDE[0])
BEAM = _module("of_the_body_guide", BODY_GUIDE[0], BODY_GUIDE[2])


class TestClearance(TaskConformance):
    def config(self) -> TaskConfig:
        task: TaskConfig = CLEARANCE.Clearance(max_steps=60)
        return task

    def robot(self) -> RobotConfig:
        return DifferentialDriveConfig(n_sensors=3)


class TestCentred(TaskConformance):
    def config(self) -> TaskConfig:
        task: TaskConfig = BEAM.CentredConfig()
        return task

    def robot(self) -> RobotConfig:
        return _beam()


class TestBallAndBeam(BodyConformance):
    def config(self) -> RobotConfig:
        return _beam()


class TestBallAndBeamAsARobot(RobotConformance):
    def config(self) -> RobotConfig:
        return _beam()


def _beam() -> RobotConfig:
    robot: RobotConfig = BEAM.BallAndBeamConfig()
    return robot


def test_the_guide_shows_the_example_s_own_file() -> None:
    assert TASK_GUIDE[0] == (ROOT / "examples" / "clearance" / "sceann_clearance.py").read_text(encoding="utf-8")
    entry = 'clearance = "sceann_clearance:Clearance"'
    assert entry in (ROOT / "examples" / "clearance" / "pyproject.toml").read_text(encoding="utf-8")
    assert entry in (ROOT / "docs" / "adding-a-task.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", ["adding-a-task.md", "adding-a-body.md"])
def test_the_tests_that_the_guides_show_can_be_run(page: str) -> None:
    before, kit = (TASK_GUIDE[0], TASK_GUIDE[1]) if "task" in page else (BODY_GUIDE[0], BODY_GUIDE[1])
    module = _module("of_a_guide_s_test", before, kit)
    (found,) = (value for name, value in vars(module).items() if name.startswith("Test"))
    assert found().config().type in ("clearance", "ball_and_beam")


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Both examples, installed."""
    entries = {
        "sceann_clearance": "[sceann_hil.tasks]\nclearance = sceann_clearance:Clearance\n",
        "ball": "[sceann_hil.tasks]\ncentred = of_the_body_guide:CentredConfig\n"
        "[sceann_hil.robots]\nball_and_beam = of_the_body_guide:BallAndBeamConfig\n",
    }
    monkeypatch.syspath_prepend(ROOT / "examples" / "clearance")
    with installed(tmp_path / "site", entries, monkeypatch):
        yield


BALL = """
task: {type: centred}
robot: {type: ball_and_beam}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 12, generations: 6}
"""
CLEAR = (ROOT / "examples" / "clearance" / "clearance.yaml").read_text(encoding="utf-8")


def _evolved(config: ExperimentConfig, folder: Path) -> JournalReader:
    with Experiment.create(config, folder) as experiment, config.robot.build() as robot:
        experiment.evolve(robot)
    return JournalReader(folder)


@pytest.mark.usefixtures("packages")
def test_the_ball_is_kept_in_the_middle_and_every_trial_is_replayed_to_the_bit(tmp_path: Path) -> None:
    config = parse_config(BALL, "test")
    reader = _evolved(config, tmp_path / "run")
    best = [row.best_fitness or 0.0 for row in reader.generations(finished=True)]
    assert best[-1] > best[0]
    attempts = reader.attempts(6)
    assert all(row.value == row.fitness for row in attempts)
    with config.robot.build() as robot:
        compared = replay(reader, config, robot, attempts)
        assert sessions_of_another_body(reader, robot, {row.session for row in attempts}) == []
        robot.neutral_motor = 0.25  # type: ignore[attr-defined]
        assert sessions_of_another_body(reader, robot, {row.session for row in attempts}) == [1]
    reader.close()
    assert all(one.equal for trial in compared for one in trial)
    assert {one.quantity for one in compared[0]} >= {"total of the steps' values", "fitness"}
    assert np.ptp([row.fitness for row in attempts]) > 0


@pytest.mark.usefixtures("packages")
def test_the_task_of_the_guide_works_in_every_command(tmp_path: Path) -> None:
    small = ("task.max_steps=50", "algorithm.population=6", "algorithm.generations=2", "controller.n_hidden=1")
    config = parse_config(CLEAR, "test", small)
    reader = _evolved(config, tmp_path / "run")
    rows = [row for g in range(3) for row in reader.attempts(g)]
    reader.close()
    assert all(row.value is not None and row.fitness == row.value / row.steps for row in rows if row.steps)

    # the viewer draws the values, and what they add up to
    source = RunSource(tmp_path / "run")
    shown = source.generation(2).trials[0]
    chunks = {chunk.entity_path: chunk for chunk in trial_chunks(source.run, shown, full=False)}
    drawn = {name: _curve(chunks[f"/signals/{name}"]) for name in ("value", "worth")}
    source.close()
    assert len(drawn["value"]) == shown.steps
    assert drawn["worth"][-1] == shown.fitness

    # a study's runs are the same runs
    block = Block(0, 0, dump_config(config), (config.seed,))
    assert compute_block(block).best[0].tolist() == pytest.approx(
        [max(_mean(rows, g).values()) for g in range(3)], abs=1e-6
    )
    # in disturbed bodies
    genomes = np.random.default_rng(0).integers(0, 2, (3, config.genome_length), np.uint8)
    assert len(measure(config, genomes, repeats=1).disturbances) >= 4
    # every genome of a network that is small enough
    tiny = parse_config(
        "task: {type: centred}\nrobot: {type: ball_and_beam}\ncontroller: {coding: sceann3, n_hidden: 0}\n"
        "algorithm: {type: sga}\n",
        "test",
    )
    landscape = enumerate_landscape(tiny, tmp_path / "landscape", 1)
    fitness = np.asarray(landscape.fitness)
    assert len(fitness) == 2**tiny.genome_length
    assert np.isfinite(fitness).all()
    assert np.ptp(fitness) > 0


def _curve(chunk: Chunk) -> list[float]:
    table = chunk.to_record_batch().to_pydict()
    (column,) = (values for name, values in table.items() if "scalars" in name.lower())
    return [float(value) for (value,) in column]


def _mean(rows: list[AttemptRow], generation: int) -> dict[int, float]:
    """Fitness of each individual of a generation."""
    found: dict[int, list[float]] = {}
    for row in rows:
        if row.generation == generation and row.fitness is not None and row.individual is not None:
            found.setdefault(row.individual, []).append(row.fitness)
    return {individual: float(np.mean(values)) for individual, values in found.items()}

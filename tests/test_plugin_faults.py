"""A fault inside a plug-in is reported as the plug-in's, with its package, its line and exit code 4."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from sceann_hil.errors import ExitCode

TASK = """
from typing import Literal
from sceann_hil.tasks.pole_balancing import PoleBalancing, PoleBalancingConfig


class Task(PoleBalancing):
    def fitness(self, results):
        {fitness}


class TaskConfig(PoleBalancingConfig):
    type: Literal["wobble"] = "wobble"

    def build(self):
        return Task(self)

    def check(self, robot):
        {check}
"""
CONFIG = """
task: {type: wobble, max_steps: 50}
robot: {type: cartpole, n_sensors: 2}
controller: {coding: sceann3, n_hidden: 1}
algorithm: {type: sga, population: 4, generations: 1}
"""
STUDY = f"""
name: wobbling
runs: 2
base:
{"".join(f"  {line}" for line in CONFIG.splitlines(keepends=True) if line.strip())}
"""


def _install(folder: Path, fitness: str = "return results.steps * 1.0", check: str = "pass") -> None:
    (folder / "wobble_task.py").write_text(TASK.format(fitness=fitness, check=check), encoding="utf-8")
    info = folder / "wobble_tasks-2.5.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: wobble-tasks\nVersion: 2.5\n")
    (info / "entry_points.txt").write_text("[sceann_hil.tasks]\nwobble = wobble_task:TaskConfig\n")
    (folder / "config.yaml").write_text(CONFIG)
    (folder / "study.yaml").write_text(STUDY)


def _sceann(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "sceann_hil.cli", *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env={"PYTHONPATH": str(folder), "PATH": "/usr/bin:/bin", "HOME": str(Path.home()), "COLUMNS": "300"},
    )


def test_a_sound_plugin_runs(tmp_path: Path) -> None:
    _install(tmp_path)
    done = _sceann(tmp_path, "evolve", "config.yaml", "--out", "run", "--record", "none")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("spoilt", "arguments"),
    [
        ({"fitness": "return results.steps / [][1]"}, ("evolve", "config.yaml", "--out", "run", "--record", "none")),
        ({"check": "raise KeyError('no such key')"}, ("plan", "config.yaml")),
        ({"fitness": "import numpy; return numpy.zeros(3) + numpy.zeros(4)"}, ("study", "study.yaml")),
    ],
    ids=["while evolving", "while checking", "in a worker process, inside NumPy"],
)
def test_a_fault_of_a_plugin_names_its_package_and_line(
    spoilt: dict[str, str], arguments: tuple[str, ...], tmp_path: Path
) -> None:
    _install(tmp_path, **spoilt)
    done = _sceann(tmp_path, *arguments)
    assert done.returncode == ExitCode.PLUGIN, done.stderr
    assert "The package wobble-tasks 2.5 failed: " in done.stderr
    assert "wobble_task.py, line " in done.stderr
    assert "Traceback" not in done.stderr


def test_the_traceback_is_there_for_the_packages_authors(tmp_path: Path) -> None:
    _install(tmp_path, check="raise KeyError('no such key')")
    done = _sceann(tmp_path, "--traceback", "plan", "config.yaml")
    assert done.returncode == ExitCode.PLUGIN
    assert "Traceback" in done.stderr

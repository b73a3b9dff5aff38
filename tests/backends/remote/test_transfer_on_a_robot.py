"""A transfer to a robot at the end of a link: killed, resumed, and every decision as if nothing had happened."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
import yaml

from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.config import parse_config
from sceann_hil.errors import NotARun
from sceann_hil.journal import JournalReader
from sceann_hil.run.experiment import Outcome
from tests.runs import evolve, resume

BODY = {"type": "diffdrive", "n_sensors": 3, "tick_s": 0.05, "top_speed_m_s": 0.8}
FAR = {**BODY, "arena_m": (9.0, 9.0), "target_m": (8.9, 8.9)}
"""On the board's pins: nobody puts it back, so it must not come to the target."""
TASK = "{type: goal_reach, max_steps: 8, start_m: [0.4, 0.4], headings_deg: [45, 20]}"
SOURCE = f"""
task: {TASK}
robot: {BODY}
controller: {{coding: sceann3, n_hidden: 1}}
algorithm: {{type: sga, population: 10, generations: 1}}
"""
KILLED_AFTER = 3


@pytest.mark.parametrize("mode", ["onboard", "tethered", "hil"])
def test_killed_in_the_middle_it_goes_on_to_the_same_decisions(mode: str, tmp_path: Path) -> None:
    evolve(tmp_path / "source", SOURCE)
    with VirtualPosix(VirtualBody(DifferentialDrive(DifferentialDriveConfig.model_validate(FAR)))) as virtual:
        facts = {"n_sensors": 3, "n_motors": 2, "tick_s": 0.05, "start_fields": ["x_m", "y_m", "heading_rad"]}
        section = {"type": "remote", "port": str(virtual.port), "mode": mode}
        section |= {"body": BODY} if mode == "hil" else facts
        robot = tmp_path / "robot.yaml"
        robot.write_text(yaml.safe_dump({"robot": section}), encoding="utf-8")
        arguments = ["transfer", robot, "--from", "source", "--out", "moved", "--trials", "9", "--rounds", "1"]
        arguments += ["--set", "uncertainty.robots=20", "--record", "none", "--operator", "none"]
        process = subprocess.Popen([sys.executable, "-m", "sceann_hil.cli", *map(str, arguments)], cwd=tmp_path)
        while _trials(tmp_path / "moved") < KILLED_AFTER and process.poll() is None:
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
        assert process.wait() == -signal.SIGKILL
        assert resume(tmp_path / "moved") is Outcome.FINISHED
    with closing(JournalReader(tmp_path / "moved")) as reader:
        config = parse_config(reader.run().config, "journal")
        algorithm = config.algorithm.for_experiment(config)
        state = algorithm.start(np.random.default_rng(0))
        numbers = [row.number for row in reader.generations()]
        assert len(numbers) > KILLED_AFTER
        for number in numbers:
            # every trial counts once, and each decision follows from the trials before it
            counted = [row for row in reader.attempts(number) if row.fitness is not None]
            assert len(counted) == (1 if state.start is not None else 2)
            assert reader.algorithm_state(number) == algorithm.dump(state)
            if number != numbers[-1]:
                state = algorithm.tell(state, reader.fitness(number), np.random.default_rng(0))


def _trials(directory: Path) -> int:
    try:
        with closing(JournalReader(directory)) as reader:
            return sum(row.end_reason is not None for g in reader.generations() for row in reader.attempts(g.number))
    except NotARun:
        return 0

"""From the twin to the makers' simulator: go on, be killed, resume, export, verify, leave the champion on it."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sceann_hil.errors import ExitCode
from sceann_hil.firmware.emulated.playground import ARENA, Playground
from sceann_hil.journal import JournalReader
from tests.commands.test_cli import sceann
from tests.runs import GOAL, evolve

pytestmark = pytest.mark.realtime

TWIN = """
task: {type: avoidance, max_steps: 6, starts: [[0.3, 0.3, 45.0]]}
robot: {type: thymio_twin}
controller: {coding: sceann3, n_hidden: 2}
algorithm: {type: sga, population: 4, generations: 1, elites: 1}
"""
ROBOT = TWIN.replace("{type: thymio_twin}", "{type: thymio, playground: true, twin: {type: thymio_twin}}")


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("runs") / "twin"
    evolve(directory, TWIN)
    return directory


def wait_until_refused(place: str) -> None:
    """What keeps the simulator keeps its port for some seconds longer."""
    host, port = place.split(":")
    deadline_s = time.monotonic() + 20.0
    while time.monotonic() < deadline_s:
        try:
            socket.create_connection((host, int(port)), timeout=5.0).close()
        except ConnectionRefusedError:
            return
        time.sleep(0.1)


def counted(directory: Path) -> list[int]:
    """Trials that have a fitness, in each generation; an empty list before there is a journal."""
    if not (directory / "journal.sqlite").exists():
        return []
    reader = JournalReader(directory)
    try:
        rows = [reader.attempts(row.number) for row in reader.generations()]
    finally:
        reader.close()
    return [sum(row.fitness is not None for row in attempts) for attempts in rows]


def test_a_run_goes_on_from_its_twin_is_killed_and_resumed(twin: Path, tmp_path: Path) -> None:
    config, run = tmp_path / "robot.yaml", tmp_path / "robot"
    config.write_text(ROBOT, encoding="utf-8")
    command = [
        sys.executable,
        "-m",
        "sceann_hil.cli",
        "evolve",
        str(config),
        "--from",
        str(twin),
        "--out",
        str(run),
        "--record",
        "none",
    ]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until_s = time.monotonic() + 90.0
    while sum(counted(run)) < 2 and time.monotonic() < until_s:
        time.sleep(0.1)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert 2 <= sum(counted(run)) < 7
    resumed = sceann("resume", run)
    assert resumed.returncode == 0, resumed.stdout + resumed.stderr
    assert counted(run)[0] == 4
    assert len(counted(run)) == 2


def test_a_champion_is_exported_verified_and_left_on_the_robot(twin: Path, tmp_path: Path) -> None:
    file = tmp_path / "champion.aesl"
    assert sceann("export", twin, "--language", "aesl", "-o", file).returncode == 0
    assert 'name="thymio-II"' in file.read_text(encoding="utf-8")
    with Playground(ARENA) as playground:
        place = f"socket://{playground.host}"
        verified = sceann("verify", twin, "--board", "thymio", "--port", place, "--sequences", 6, "--json")
        told = json.loads(verified.stdout)
        assert (told["equal"], told["recorded_sequences"]) == (True, 1)
        left = sceann("flash", twin, "--board", "thymio", "--port", place)
        assert "words of byte code on the Thymio" in left.stdout
    wait_until_refused(playground.host)
    gone = sceann("flash", twin, "--board", "thymio", "--port", place)
    assert gone.returncode == ExitCode.FLASH
    assert "cannot be reached" in gone.stderr
    refused = sceann("flash", twin, "--board", "thymio", "--port", place, "--autorun", 50)
    assert refused.returncode == ExitCode.USAGE


def test_a_robot_with_other_sensors_is_not_exported(tmp_path: Path) -> None:
    evolve(tmp_path / "goal", GOAL)
    refused = sceann("export", tmp_path / "goal", "--language", "aesl")
    assert refused.returncode == ExitCode.FIRMWARE_BUILD
    assert "expected a robot of 7 (infrared), 2 (ground) or 9 sensors" in refused.stderr

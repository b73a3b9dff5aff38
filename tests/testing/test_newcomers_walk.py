"""A newcomer's walk: the guide's own task evolves in simulation and runs on a virtual robot in all three modes."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

from backends.simulation.body import SimulatedBody
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.cli import app
from sceann_hil.config import journalled_config
from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.journal import AttemptKind, JournalReader
from sceann_hil.network.coding import genome_from_hex
from sceann_hil.network.controller import ONE, SENSOR_MAX
from sceann_hil.recording.chunks import trial_chunks
from sceann_hil.recording.source import RunSource
from sceann_hil.run.replay import trace_from_sensors
from tests.installed import installed

EXAMPLE = Path(__file__).parents[2] / "examples" / "clearance"
FAST = (
    "task.max_steps=20",
    "robot.tick_s=0.04",
    "robot.top_speed_m_s=0.4",
    "robot.motion_noise=0.0",
    "algorithm.population=10",
    "algorithm.generations=3",
)


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.syspath_prepend(EXAMPLE)
    entry = {"sceann_clearance": "[sceann_hil.tasks]\nclearance = sceann_clearance:Clearance\n"}
    with installed(tmp_path / "site", entry, monkeypatch):
        yield


def said(*arguments: object) -> str:
    result = CliRunner().invoke(app, [str(argument) for argument in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


def compared(run: Path, folder: Path, robot: dict[str, object]) -> dict[str, object]:
    file = folder / f"{robot['mode']}.yaml"
    file.write_text(yaml.safe_dump({"robot": {"type": "remote", "reconnect_s": 5.0, **robot}}))
    told = said("compare", run, "--on", file, "--top", 1, "--repeats", 1, "--operator", "none", "--json")
    document: dict[str, object] = json.loads(told[told.index("{") :])
    return document


@pytest.mark.realtime
@pytest.mark.usefixtures("package")
def test_the_guides_task_has_the_same_fitness_in_simulation_and_in_every_mode(tmp_path: Path) -> None:
    run = tmp_path / "run"
    changes = [text for change in FAST for text in ("--set", change)]
    said("evolve", EXAMPLE / "clearance.yaml", "--out", run, *changes)
    assert "the same" in said("replay", run, "--all")
    source = RunSource(run)
    best = source.trials_of_best(3)
    assert best
    assert "/signals/value" in {chunk.entity_path for chunk in trial_chunks(source.run, best[0], full=True)}
    source.close()

    config = yaml.safe_load((run / "config.yaml").read_text())
    found = {}
    with PosixBoard(terminal=True) as board:
        body = config["robot"]
        found["hil"] = compared(run, tmp_path, {"mode": "hil", "port": str(board.port), "body": body})
    reader = JournalReader(run)
    simulated = journalled_config(reader).robot.build()
    reader.close()
    assert isinstance(simulated, SimulatedBody)
    with VirtualPosix(VirtualBody(simulated)) as virtual:
        assert virtual.rig is not None
        real = {
            "port": str(virtual.port),
            "n_sensors": 4,
            "n_motors": 2,
            "tick_s": 0.04,
            "start_fields": list(simulated.spec.start_fields),
            "bumper": "rig",
            "rig": virtual.rig.address,
        }
        for mode in ("tethered", "onboard"):
            found[mode] = compared(run, tmp_path, {"mode": mode, **real})
    for mode, document in found.items():
        (genome,) = document["genomes"]  # type: ignore[misc]
        # a tick that came late on a busy machine lets the body see something else, and is worth something else
        assert abs(genome["gap"]) <= (0.0 if mode == "hil" else 0.05), mode
    _is_the_formula_of_what_the_robot_told(run)
    assert (run / "reports" / "compare" / "trajectories.png").stat().st_size > 10_000


def _is_the_formula_of_what_the_robot_told(run: Path) -> None:
    """Each trial's fitness is the guide's formula in plain Python over the journalled sensors, to the last bit."""
    reader = JournalReader(run)
    rows = [row for row in reader.attempts_of_kind(AttemptKind.MEASUREMENT) if row.fitness is not None]
    phenotype = journalled_config(reader).phenotype
    assert len(rows) == 9
    for row in rows:
        bits = genome_from_hex(row.genome or "", phenotype.genome_length)
        trace = trace_from_sensors(reader, row.id, phenotype.decode(bits[None])[0], phenotype)
        assert trace is not None
        total = 0.0
        for sensors, x in zip(trace.sensors / SENSOR_MAX, trace.x / ONE, strict=True):
            left, right = x[-2], x[-1]
            total += 0.5 * (left + right) * (1 - np.sqrt(abs(left - right))) * (1 - sensors.max())
        assert row.fitness == total / row.steps  # type: ignore[operator]
    reader.close()

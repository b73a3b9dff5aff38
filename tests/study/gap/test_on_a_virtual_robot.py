"""A robot whose body has a gap, at the end of a serial line: the gap is found from what its firmware sent."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from backends.cartpole import CartPole
from backends.simulation.gap import Gap
from backends.simulation.gap import Spread as GapSpread
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.cli import app
from sceann_hil.errors import ConfigError
from sceann_hil.journal import JournalReader
from sceann_hil.run.experiment import Experiment, Outcome
from sceann_hil.run.rehearsal import rehearsal
from sceann_hil.supervision.operators import Desk
from sceann_hil.supervision.operators.script import Script, Step
from tests.backends.remote.phases import counted_results
from tests.backends.remote.trials import hil_robot, pole_run, real_robot
from tests.runs import config_of, evolve, measure_on


def test_its_gap_is_estimated_from_its_own_traces(tmp_path: Path) -> None:
    gap = Gap(sensor_offset=GapSpread(0.015), motor_gain=GapSpread(0.85), latency_steps=GapSpread(1.0))
    with VirtualPosix(VirtualBody(CartPole(gap=gap))) as virtual, CartPole() as simulation:
        config = config_of(pole_run(real_robot(virtual, virtual.port), max_steps=80))
        with config.robot.build() as robot:
            genomes = np.random.default_rng(4).integers(0, 2, (10, config.genome_length), dtype=np.uint8)
            real = measure_on(tmp_path / "run", config, robot, genomes)
            timing = robot.timing
        found = simulation.estimate_gap(real.starts, real.traces)
    assert found.latency_steps.value == 1
    assert found.motor_gain[0].value == pytest.approx(0.85, abs=0.04)
    assert [one.value for one in found.sensor_offset] == pytest.approx([0.015, 0.015], abs=0.004)
    assert any("round trip" in name for name in timing)
    assert any("lateness" in name for name in timing)
    assert all(len(durations) > 0 for durations in timing.values())


def test_an_attended_run_on_a_virtual_robot_with_everything_that_can_be_said(tmp_path: Path) -> None:
    with VirtualPosix(VirtualBody(CartPole())) as virtual:
        robot = real_robot(virtual, virtual.port).replace("rig:", "attended: true, rig:")
        config = config_of(pole_run(robot, population=2, generations=1, max_steps=3000))
        lines = ["ready", "running: stop after 0.1 s", "ready", "redo", "ready", "running: pause_now after 0.1 s"]
        lines += ["paused: resume", "skip"] + ["ready", "accept"] * 10
        desk = Desk()
        with (
            Experiment.create(config, tmp_path / "run") as experiment,
            config.robot.build() as remote,
            Script(desk, [Step.parse(line) for line in lines]),
        ):
            assert experiment.evolve(remote, desk=desk) is Outcome.FINISHED
    rows = [row for g in (0, 1) for row in JournalReader(tmp_path / "run").attempts(g)]
    assert sum(row.fitness is not None for row in rows) == 4
    notes = [row.note for row in rows if row.fitness is None]
    assert notes == ["stop by an operator", "redo: to be done again", "pause now by an operator"]
    assert all((row.robot_s or 0.0) > 0.05 for row in rows)


def test_a_run_in_the_loop_is_rehearsed_with_its_own_body() -> None:
    with rehearsal(config_of(pole_run(hil_robot("nowhere")))) as play:
        assert play.config.robot.type == "cartpole"
        assert json.loads(play.config.operator.model_dump_json())["who"] == ["script"]


SPEC = CartPole().spec
REAL = f"""{{type: remote, port: nowhere, mode: MODE, n_sensors: 2, n_motors: {SPEC.n_motors}, tick_s: {SPEC.tick_s},
    bumper: fell, start_fields: [{", ".join(SPEC.start_fields)}]}}"""


@pytest.mark.parametrize("mode", ["onboard", "tethered"])
def test_a_rehearsal_with_firmware_asks_a_person_and_runs_on_a_board(mode: str, tmp_path: Path) -> None:
    (tmp_path / "c.yaml").write_text(pole_run(REAL.replace("MODE", mode), population=2, generations=1, max_steps=15))
    result = CliRunner().invoke(
        app, ["rehearse", str(tmp_path / "c.yaml"), "--firmware", "--json", "--out", str(tmp_path / "run")]
    )
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert (document["outcome"], document["trials"] - document["void"]) == ("finished", 4)
    assert document["prompts"] == 2 * document["trials"]
    # on a board, a trial takes its time
    assert document["robot_s"] > 0.02


def test_a_rehearsal_with_firmware_in_the_loop_gives_what_a_simulation_gives(tmp_path: Path) -> None:
    small = {"population": 3, "generations": 1, "max_steps": 40}
    evolve(tmp_path / "sim", pole_run("{type: cartpole, n_sensors: 2}", **small))
    with (
        rehearsal(config_of(pole_run(hil_robot("nowhere"), **small)), firmware=True) as play,
        Experiment.create(play.config, tmp_path / "run") as experiment,
        play.robot as robot,
    ):
        assert experiment.evolve(robot) is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == counted_results(tmp_path / "sim")


def test_a_simulated_robot_has_no_firmware_to_rehearse(tmp_path: Path) -> None:
    with (
        pytest.raises(ConfigError, match="robot cartpole has no firmware"),
        rehearsal(config_of(pole_run("{type: cartpole, n_sensors: 2}")), firmware=True),
    ):
        pass

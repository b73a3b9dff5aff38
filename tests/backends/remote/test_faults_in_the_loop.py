"""Everything that can go wrong in mode hil, against the firmware itself. Afterwards: the simulated run's results."""

from __future__ import annotations

import os
import signal
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from backends.virtual.cable import Cable, LineFaults
from sceann_hil.errors import DiskFull, NotARun, as_user_error
from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.journal import JournalReader
from sceann_hil.robot import EndReason, LinkError
from sceann_hil.run.experiment import Experiment, Outcome
from tests.backends.remote.phases import PHASES, counted_results, in_phase
from tests.backends.remote.trials import hil_robot, pole_run
from tests.runs import config_of, evolve, resume

SMALL = {"population": 3, "generations": 1, "max_steps": 25}


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[object, ...]]:
    """What the same run gives in simulation."""
    directory = tmp_path_factory.mktemp("simulated") / "run"
    evolve(directory, pole_run("{type: cartpole, n_sensors: 2}", **SMALL))
    return counted_results(directory)


def attempts(directory: Path) -> list[Any]:
    reader = JournalReader(directory)
    try:
        return [row for generation in reader.generations() for row in reader.attempts(generation.number)]
    finally:
        reader.close()


def start_or_resume(directory: Path, text: str) -> Outcome:
    try:
        experiment = Experiment.open(directory)
    except NotARun:
        return evolve(directory, text)
    experiment.close()
    return resume(directory)


@pytest.mark.parametrize("phase", PHASES)
def test_the_host_is_killed(bad_board: tuple[PosixBoard, Cable], phase: str, expected: object, tmp_path: Path) -> None:
    _, line = bad_board
    text = pole_run(hil_robot(line.port), **SMALL)
    pid = os.fork()
    if pid == 0:
        with pytest.MonkeyPatch.context() as patch:
            in_phase(patch, phase, lambda: os.kill(os.getpid(), signal.SIGKILL))
            try:
                evolve(tmp_path / "run", text)
            finally:
                os._exit(0)
    _, status = os.waitpid(pid, 0)
    assert os.WIFSIGNALED(status)
    assert start_or_resume(tmp_path / "run", text) is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == expected
    if phase == "RESULT":
        # the robot remembered: its result was taken, not measured a second time
        assert all(row.attempt == 0 for row in attempts(tmp_path / "run"))


@pytest.mark.parametrize("phase", PHASES)
def test_the_robot_loses_power(
    bad_board: tuple[PosixBoard, Cable],
    phase: str,
    expected: object,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    board, line = bad_board

    def power_cycle() -> None:
        board.power_off()
        board.power_on()

    struck = in_phase(monkeypatch, phase, power_cycle)
    assert evolve(tmp_path / "run", pole_run(hil_robot(line.port), **SMALL)) is Outcome.FINISHED
    assert struck.is_set()
    assert counted_results(tmp_path / "run") == expected


@pytest.mark.parametrize("phase", ["LOAD", "TICK", "STOP"])
def test_the_cable_is_pulled_and_plugged_in_again(
    bad_board: tuple[PosixBoard, Cable],
    phase: str,
    expected: object,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    _, line = bad_board
    plugging = threading.Timer(0.5, line.plug)

    def pull() -> None:
        line.pull()
        plugging.start()

    struck = in_phase(monkeypatch, phase, pull)
    assert evolve(tmp_path / "run", pole_run(hil_robot(line.port), **SMALL)) is Outcome.FINISHED
    assert struck.is_set()
    plugging.join()
    assert counted_results(tmp_path / "run") == expected


def test_a_cable_that_stays_out_pauses_the_run_which_can_be_resumed(
    bad_board: tuple[PosixBoard, Cable], expected: object, tmp_path: Path
) -> None:
    _, line = bad_board
    with pytest.MonkeyPatch.context() as patch:
        in_phase(patch, "TICK", line.pull)
        with pytest.raises(LinkError) as error:
            evolve(tmp_path / "run", pole_run(hil_robot(line.port, reconnect_s=0.3), **SMALL))
    told = as_user_error(error.value)
    assert told is not None
    assert "sceann resume" in told.hint
    assert [row.end_reason for row in attempts(tmp_path / "run")][-1] in (EndReason.LINK_LOST, None)
    line.plug()
    assert resume(tmp_path / "run") is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == expected


@pytest.mark.parametrize(
    "faults",
    [
        LineFaults(lost=0.03),
        LineFaults(doubled=0.05),
        LineFaults(spoilt=0.03),
        LineFaults(swapped=0.03),
        LineFaults(lost=0.01, doubled=0.02, spoilt=0.01, swapped=0.01),
    ],
    ids=["lost", "doubled", "spoilt", "swapped", "all"],
)
def test_frames_go_wrong(
    bad_board: tuple[PosixBoard, Cable], faults: LineFaults, expected: object, tmp_path: Path
) -> None:
    _, line = bad_board
    line.faults = faults
    assert evolve(tmp_path / "run", pole_run(hil_robot(line.port), **SMALL)) is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == expected


def test_the_wall_clock_jumps(
    bad_board: tuple[PosixBoard, Cable],
    expected: object,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    real, calls = time.time, iter(range(10**9))
    monkeypatch.setattr(time, "time", lambda: real() + 3600.0 * (-1) ** next(calls))
    monkeypatch.setattr("can.bus.time", lambda: real() + 3600.0 * (-1) ** next(calls))
    _, line = bad_board
    assert evolve(tmp_path / "run", pole_run(hil_robot(line.port), **SMALL)) is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == expected
    assert all(row.attempt == 0 for row in attempts(tmp_path / "run"))


def test_the_disk_is_full_in_the_middle_of_a_run(bad_board: tuple[PosixBoard, Cable], tmp_path: Path) -> None:
    _, line = bad_board
    evolve(tmp_path / "simulated", pole_run("{type: cartpole, n_sensors: 2}", population=12, max_steps=25))
    config = config_of(pole_run(hil_robot(line.port), population=12, max_steps=25))
    with Experiment.create(config, tmp_path / "run") as experiment, config.robot.build() as robot:
        database = experiment.journal._db
        pages = database.execute("PRAGMA page_count").fetchone()[0]
        database.execute(f"PRAGMA max_page_count = {pages + 1}")
        with pytest.raises(DiskFull) as error:
            experiment.evolve(robot)
    told = as_user_error(error.value)
    assert told is not None
    assert told.exit_code == 20
    assert resume(tmp_path / "run") is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == counted_results(tmp_path / "simulated")


def test_a_second_host_is_refused(bad_board: tuple[PosixBoard, Cable]) -> None:
    _, line = bad_board
    config = config_of(pole_run(hil_robot(line.port, reconnect_s=0.2)))
    with config.robot.build(), pytest.raises(LinkError, match="exclusively lock"):
        config.robot.build().connect()

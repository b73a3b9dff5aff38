"""One trial in each control mode on the firmware itself: the bits are the simulation's."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np
import pytest

from backends.cartpole import CartPole, CartPoleConfig
from backends.diffdrive import DifferentialDriveConfig
from backends.remote import RemoteConfig
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.journal import JOURNAL_NAME, JournalReader
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.network.recompute import recompute
from sceann_hil.robot import EndReason, LinkError, RobotFault, Trials
from tests.backends.remote.trials import counted, hil_robot, pole_run, pole_trials, virtual_config
from tests.runs import contents, evolve


def test_a_run_in_the_loop_is_the_simulated_run_bit_for_bit(board: PosixBoard, tmp_path: Path) -> None:
    evolve(tmp_path / "sim", pole_run("{type: cartpole, n_sensors: 2}"))
    evolve(tmp_path / "hil", pole_run(hil_robot(board.port)))
    simulated, looped = contents(tmp_path / "sim"), contents(tmp_path / "hil")
    for table in ("generation", "individual", "attempt"):
        assert looped[table] == simulated[table]


def test_what_the_robot_sensed_is_in_the_journal(board: PosixBoard, tmp_path: Path) -> None:
    evolve(tmp_path / "hil", pole_run(hil_robot(board.port), population=3, generations=0))
    reader = JournalReader(tmp_path / "hil")
    attempts = reader.attempts(0)
    for row in attempts:
        measured = reader.sensor_trace(row.id)
        assert measured is not None
        assert measured[0].shape == (row.steps, 2)
        assert tuple(measured[1][-1].tolist()) == row.final_state
    reader.close()
    assert (
        len(attempts)
        == sqlite3.connect(tmp_path / "hil" / JOURNAL_NAME).execute("SELECT count(*) FROM trace").fetchone()[0]
    )


@pytest.mark.parametrize("neuron", Neuron)
@pytest.mark.parametrize("n_sensors", [3, 7, 12], ids=["one page", "two pages", "two full pages"])
def test_networks_of_one_and_two_sensor_pages(board: PosixBoard, n_sensors: int, neuron: Neuron) -> None:
    body = DifferentialDriveConfig(n_sensors=n_sensors)
    rng = np.random.default_rng(n_sensors)
    size = NetworkSize(n_sensors, 2, 2)
    trials = Trials(
        size=size,
        dynamics=Dynamics(neuron, initial_output=100),
        weights=rng.integers(-1, 2, (4, size.n_neurons, size.n_sources)).astype(np.int8),
        genome_index=np.arange(4, dtype=np.int32),
        starts=np.tile([[0.1, 0.1, 0.7]], (4, 1)),
        keys=rng.integers(0, 2**64, 4, np.uint64),
        max_steps=60,
        ids=np.arange(1, 5),
    )
    expected = body.build().trace(trials)
    with RemoteConfig(port=str(board.port), mode="hil", body=body).build() as robot:
        for k, trial in enumerate(trials.batches(1)):
            results = robot.run(trial)
            assert results.hashes[0] == expected.hashes[k]
            assert results.steps[0] == expected.steps[k]
            assert results.end_reasons[0] == expected.end_reasons[k]
            assert results.traces is not None
            assert expected.traces is not None
            assert np.array_equal(results.traces[0].state, expected.traces[k].state)
            assert np.array_equal(results.traces[0].u, expected.traces[k].u)


@pytest.mark.parametrize("mode", ["onboard", "tethered"])
def test_a_trial_in_real_time_is_the_simulated_trial_bit_for_bit(virtual: VirtualPosix, mode: str) -> None:
    trials = pole_trials(4, max_steps=25)
    expected = CartPole().trace(trials)
    with virtual_config(virtual, mode).build() as robot:
        for k, trial in enumerate(trials.batches(1)):
            results = counted(robot, trial)
            assert EndReason(results.end_reasons[0]) == expected.end_reasons[k], robot.health()
            assert results.steps[0] == expected.steps[k]
            assert results.hashes[0] == expected.hashes[k]
            assert expected.traces is not None
            assert results.traces is not None
            assert np.array_equal(results.traces[0].sensors, expected.traces[k].sensors)
            assert np.array_equal(results.traces[0].x, expected.traces[k].x)
            assert results.traces[0].state.shape == (results.steps[0] + 1, 0)


@pytest.mark.parametrize("mode", ["onboard", "tethered"])
def test_the_host_ends_a_trial_whose_sensors_say_so(virtual: VirtualPosix, mode: str) -> None:
    """Half of the angle's range is 18 degrees: the pole passes it before it lies."""
    config = virtual_config(virtual, mode, ends=[{"reason": "out_of_bounds", "sensor": 1, "above": 0.75}])
    trials = pole_trials(8, max_steps=60)
    traces = CartPole().trace(trials).traces
    assert traces is not None
    falls = [k for k in range(8) if (traces[k].sensors[:, 1] > 0.75 * 1023).any()]
    assert falls
    with config.build() as robot:
        results = counted(robot, trials.take(np.array(falls[:1])))
    first = int(np.argmax(traces[falls[0]].sensors[:, 1] > 0.75 * 1023))
    assert EndReason(results.end_reasons[0]) is EndReason.OUT_OF_BOUNDS
    assert results.steps[0] == first + 1
    neurons = recompute(trials.weights[falls[0]], trials.size, trials.dynamics, traces[falls[0]].sensors)
    assert results.hashes[0] == neurons.hashes[first]


def test_a_robot_that_computes_something_else_is_a_fault_that_names_the_step(
    board: PosixBoard, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The host is made to believe in other weights than the ones that the robot has."""
    import backends.remote.robot as module

    def other(weights, size, dynamics, sensors):  # type: ignore[no-untyped-def]
        changed = weights.copy()
        changed[0, 0] = -changed[0, 0]
        return recompute(changed, size, dynamics, sensors)

    monkeypatch.setattr(module, "recompute", other)
    with RemoteConfig(port=str(board.port), mode="hil", body=CartPoleConfig()).build() as robot:
        results = robot.run(pole_trials(1, max_steps=30))
        assert EndReason(results.end_reasons[0]) is EndReason.FAULT
        assert "first in step 0" in robot.health().messages[0]


def test_such_a_fault_stops_the_run_and_leaves_no_fitness(
    board: PosixBoard, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    import backends.remote.robot as module

    monkeypatch.setattr(module, "recompute", lambda weights, *rest: recompute(-weights, *rest))
    with pytest.raises(RobotFault, match="first in step"):
        evolve(tmp_path / "run", pole_run(hil_robot(board.port)))
    reader = JournalReader(tmp_path / "run")
    (row,) = reader.attempts(0)
    assert (row.end_reason, row.fitness) == (EndReason.FAULT, None)
    reader.close()


def test_the_wrong_robot_is_refused_before_anything_moves(virtual: VirtualPosix, board: PosixBoard) -> None:
    with pytest.raises(LinkError, match="expected 3 sensors"):
        virtual_config(virtual, "onboard", n_sensors=3).build().connect()
    with pytest.raises(LinkError, match="tick_s"):
        virtual_config(virtual, "onboard", tick_s=5.0).build().connect()
    with pytest.raises(LinkError, match="no sensors and motors"):
        virtual_config(virtual, "onboard", port=str(board.port)).build().connect()


def test_a_port_that_is_not_there_is_one_clear_error() -> None:
    robot = RemoteConfig(port="/dev/no_such_port", mode="hil", body=CartPoleConfig(), reconnect_s=0.1).build()
    with pytest.raises(LinkError, match="/dev/no_such_port"):
        robot.connect()

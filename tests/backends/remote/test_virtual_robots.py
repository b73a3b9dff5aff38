"""Robots without hardware on every board and every kind of line, seen only through that line."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import can
import numpy as np
import pytest

from backends.cartpole import CartPole, CartPoleConfig
from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.remote import RemoteConfig
from backends.remote.connection import RemoteSettings
from backends.remote.robot import RemoteRobot
from backends.virtual.body import Battery, VirtualBody
from backends.virtual.cable import Cable, LineFaults
from backends.virtual.can_bridge import CanBridge
from backends.virtual.power import switch_on
from backends.virtual.virtual_posix import VirtualPosix
from backends.virtual.virtual_uno import VirtualUno
from backends.world.config import InfraredConfig, WorldConfig
from sceann_hil.errors import CannotWrite, ConfigError
from sceann_hil.firmware.build import Board
from sceann_hil.firmware.emulated.qemu import QemuBoard
from sceann_hil.link.session import RobotLink
from sceann_hil.link.vocabulary import Function, Mode
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import EndReason, Trials
from sceann_hil.run.experiment import Outcome
from tests.backends.remote.phases import counted_results, in_phase
from tests.backends.remote.trials import counted, hil_robot, pole_run, pole_trials
from tests.runs import evolve, resume

needs_avr = pytest.mark.skipif(shutil.which("avr-gcc") is None, reason="avr-gcc is not installed")
needs_qemu = pytest.mark.skipif(
    shutil.which("qemu-system-arm") is None or shutil.which("arm-none-eabi-gcc") is None,
    reason="qemu-system-arm or arm-none-eabi-gcc is not installed",
)
WHEELS = DifferentialDrive(DifferentialDriveConfig(n_sensors=3, tick_s=0.05))
SIZE = NetworkSize(3, 0, 2)


def wheel_trial(first_id: int, weights: list[list[int]], max_steps: int = 20) -> Trials:
    return Trials(
        size=SIZE,
        dynamics=Dynamics(),
        weights=np.array([weights], np.int8),
        genome_index=np.zeros(1, np.int32),
        starts=np.array([[0.1, 0.1, 0.7]]),
        keys=np.array([3], np.uint64),
        max_steps=max_steps,
        ids=np.array([first_id]),
    )


STRAIGHT_ON = [[1, 1, 1, 0, 0], [1, 1, 1, 0, 0]]


def uno_config(uno: VirtualUno, mode: str = "onboard") -> RemoteConfig:
    assert uno.rig is not None
    return RemoteConfig(
        port=uno.port,
        mode=mode,  # type: ignore[arg-type]
        n_sensors=3,
        n_motors=2,
        tick_s=0.05,
        start_fields=WHEELS.spec.start_fields,
        rig=uno.rig.address,
        bumper="goal",
    )


def test_mode_hil_over_a_can_bus() -> None:
    with VirtualPosix(None, terminal=False) as board:
        bridge = CanBridge(board.socket, can.Bus(interface="virtual", channel="robot"))
        trials = pole_trials(3, max_steps=40)
        expected = CartPole().run(trials)
        robot = RemoteRobot(
            CartPoleConfig().spec,
            RemoteSettings(Mode.HIL),
            lambda: can.Bus(interface="virtual", channel="robot"),
            CartPole(),
        )
        with robot:
            hashes = [robot.run(one).hashes[0] for one in trials.batches(1)]
        bridge.close()
    assert hashes == expected.hashes.tolist()


def test_two_processes_share_a_multicast_channel() -> None:
    with switch_on(Board.POSIX, None, can="udp_multicast:239.74.163.2") as robot:
        section = {**robot.section("hil"), "body": CartPoleConfig()}
        trials = pole_trials(2, max_steps=40)
        with RemoteConfig.model_validate(section).build() as remote:
            hashes = [remote.run(one).hashes[0] for one in trials.batches(1)]
    assert hashes == CartPole().run(trials).hashes.tolist()


@needs_avr
def test_the_uno_drives_a_body_through_its_own_converters_and_pwm() -> None:
    body = VirtualBody(WHEELS)
    with VirtualUno(body) as uno, uno_config(uno).build() as robot:
        results = counted(robot, wheel_trial(1, STRAIGHT_ON))
        assert EndReason(results.end_reasons[0]) is EndReason.TIME_UP, robot.health()
        driven = np.hypot(*(body._body.state[:2] - 0.1))
    assert 0.02 < driven < 0.08 * 0.05 * 20
    assert any(change.duty[0] > 0 for change in uno.driver_log)
    assert uno.driver_log[-1].duty == (0, 0)


@needs_avr
def test_the_unos_motors_stop_when_its_host_is_killed() -> None:
    body = VirtualBody(WHEELS)
    with VirtualUno(body) as uno:
        config = uno_config(uno)
        pid = os.fork()
        if pid == 0:
            with pytest.MonkeyPatch.context() as patch:
                in_phase(patch, "LATE TICK", lambda: os.kill(os.getpid(), signal.SIGKILL))
                try:
                    with config.build() as robot:
                        robot.run(wheel_trial(1, STRAIGHT_ON, max_steps=200))
                finally:
                    os._exit(0)
        _, status = os.waitpid(pid, 0)
        killed_s = time.monotonic()
        assert os.WIFSIGNALED(status)
        time.sleep(0.6)
        assert any(change.duty != (0, 0) for change in uno.driver_log if change.time_s < killed_s)
        assert uno.driver_log[-1].duty == (0, 0)
        assert uno.driver_log[-1].time_s - killed_s <= 0.35


@needs_avr
def test_the_uno_remembers_its_last_trial_over_a_power_cycle() -> None:
    with VirtualUno(VirtualBody(WHEELS)) as uno:
        with uno_config(uno).build() as robot:
            trial = wheel_trial(7, STRAIGHT_ON, max_steps=5)
            results = robot.run(trial)
        uno.power_cycle()
        with uno_config(uno).build() as robot:
            settled = robot.settle(trial)
    assert settled.hashes.tolist() == results.hashes.tolist()
    assert settled.steps.tolist() == [5]


@needs_qemu
@pytest.mark.parametrize("board", [Board.LM3S6965, Board.STM32F405])
def test_a_run_in_the_loop_on_a_cortex_m_survives_the_death_of_its_host(board: Board, tmp_path: Path) -> None:
    small = {"population": 3, "generations": 1, "max_steps": 20}
    evolve(tmp_path / "sim", pole_run("{type: cartpole, n_sensors: 2}", **small))
    store = tmp_path / "eeprom" if board is Board.LM3S6965 else None
    with switch_on(board, None, store=store) as robot:
        section = robot.section("hil")
        text = pole_run(f"{{type: remote, port: {section['port']}, mode: hil, body: {{type: cartpole}}}}", **small)
        pid = os.fork()
        if pid == 0:
            with pytest.MonkeyPatch.context() as patch:
                in_phase(patch, "LATE TICK", lambda: os.kill(os.getpid(), signal.SIGKILL))
                try:
                    evolve(tmp_path / "run", text)
                finally:
                    os._exit(0)
        _, status = os.waitpid(pid, 0)
        assert os.WIFSIGNALED(status)
        assert resume(tmp_path / "run") is Outcome.FINISHED
    assert counted_results(tmp_path / "run") == counted_results(tmp_path / "sim")


@needs_qemu
def test_a_run_in_the_loop_on_a_cortex_m_at_the_end_of_a_bad_cable(tmp_path: Path) -> None:
    small = {"population": 3, "generations": 1, "max_steps": 20}
    evolve(tmp_path / "sim", pole_run("{type: cartpole, n_sensors: 2}", **small))
    with QemuBoard(Board.LM3S6965, eeprom=tmp_path / "eeprom") as board:
        cable = Cable(board.line.socket, tmp_path / "port")
        cable.faults = LineFaults(lost=0.01, doubled=0.02, spoilt=0.02, swapped=0.01)
        assert evolve(tmp_path / "run", pole_run(hil_robot(cable.port), **small)) is Outcome.FINISHED
        cable.close()
    assert counted_results(tmp_path / "run") == counted_results(tmp_path / "sim")


def test_a_body_that_does_not_fit_an_uno_is_refused() -> None:
    with pytest.raises(ConfigError, match="2 motors"), switch_on(Board.UNO, CartPoleConfig()):
        pass
    with (
        pytest.raises(ConfigError, match="at most 5 sensors"),
        switch_on(Board.UNO, DifferentialDriveConfig(n_sensors=7)),
    ):
        pass


def test_a_port_is_never_overwritten(tmp_path: Path) -> None:
    taken = tmp_path / "port"
    taken.write_text("mine")
    with pytest.raises(CannotWrite), switch_on(Board.POSIX, None, port=taken):
        pass
    assert taken.read_text() == "mine"


def test_the_battery_drains_while_the_motors_are_driven() -> None:
    body = VirtualBody(CartPole(), battery=Battery(full_v=8.0, empty_v=6.0, lasts_s=0.1))
    full = body.battery_mv
    for _ in range(3):
        body.sense()
        body.drive([1024])
    assert full == 8000
    assert 6000 < body.battery_mv < full
    for _ in range(3):
        body.sense()
        body.drive([1024])
    assert body.alarms & 0x08


def test_python_cans_own_logger_reads_a_robot_on_a_serial_port(tmp_path: Path) -> None:
    heard: list[int] = []
    # its file says nothing before it is closed, so nobody can see when it has heard something: it may take its time
    for listening_s in (0.5, 2.0, 8.0, 30.0):
        log = tmp_path / f"log-{listening_s:g}.asc"
        with VirtualPosix(None) as board:
            command = [sys.executable, "-m", "can.logger", "-i", "sceann_serial", "-c", board.port, "-f", log]
            logging = subprocess.Popen(command, stdout=subprocess.DEVNULL)
            while not log.exists():
                assert logging.poll() is None
                time.sleep(0.05)
            time.sleep(listening_s)
            logging.send_signal(signal.SIGINT)
            logging.wait(timeout=60)
        heard = [message.arbitration_id for message in can.LogReader(log)]
        if heard:
            break
    assert heard
    assert set(heard) <= {Function.HEARTBEAT + 1, Function.EVENT + 1}


def test_the_link_reads_heartbeats_of_an_idle_robot() -> None:
    with VirtualPosix(VirtualBody(CartPole())) as virtual:
        link = RobotLink(can.Bus(interface="sceann_serial", channel=virtual.port))
        link.hello()
        while not link.battery_mv:
            assert link.receive(1.0) is not None
        assert link.battery_mv == 8400
        link.close()


@pytest.mark.parametrize("mode", ["onboard", "tethered"])
def test_a_virtual_robot_that_leaves_its_arena_has_not_reached_a_goal(mode: str) -> None:
    world = WorldConfig(infrared=(InfraredConfig(direction_deg=0.0),), backwards=False, bump="end")
    body = DifferentialDriveConfig(world=world, tick_s=0.05, top_speed_m_s=0.4)
    spec = body.spec
    size = NetworkSize(spec.n_sensors, 1, spec.n_motors)
    trials = Trials(
        size=size,
        dynamics=Dynamics(),
        weights=np.ones((1, size.n_neurons, size.n_sources), np.int8),
        genome_index=np.zeros(1, np.int32),
        starts=np.array([[0.5, 0.3, 0.0]]),
        keys=np.ones(1, np.uint64),
        max_steps=60,
        ids=np.array([1]),
    )
    assert body.build().run(trials).end_reasons[0] == EndReason.OUT_OF_BOUNDS
    with switch_on(Board.POSIX, body) as virtual:
        section = RemoteConfig.model_validate_json(json.dumps(virtual.section(mode)))
        with section.build() as robot:
            results = counted(robot, trials)
    assert EndReason(results.end_reasons[0]) is EndReason.OUT_OF_BOUNDS

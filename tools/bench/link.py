"""The robot link: how near to the wire's limit, how punctual, and what it costs the host."""

from __future__ import annotations

import multiprocessing
import os
import signal
import socket
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from figures import Figure
from numpy.typing import NDArray

from backends.diffdrive import DifferentialDrive, DifferentialDriveConfig
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.config import parse_config
from sceann_hil.firmware.emulated.posix import BOARD_RECORD, BODY_RECORD, PosixBoard, RecordKind
from sceann_hil.link.hil import run_hil_trial
from sceann_hil.link.line import Incoming
from sceann_hil.link.messages import arm_arguments, start_arguments
from sceann_hil.link.serial_bus import SceannSerialBus
from sceann_hil.link.session import RobotLink
from sceann_hil.link.trial import Order
from sceann_hil.link.upload import upload
from sceann_hil.link.vocabulary import Function, Mode, Op, Telemetry
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.recording import RecorderProcess
from sceann_hil.recording.feed import LiveFeed
from sceann_hil.robot import EndReason, Robot
from sceann_hil.run.experiment import Experiment

SENSE_LIMIT = {115_200: 823.0, 500_000: 500_000 / 140}
"""SENSE frames per second that fit the wire: 14 bytes of 10 bits (docs/link.md)."""
LOCKSTEP_LIMIT = {115_200: 411.0, 500_000: 1785.0}
"""Lock-steps per second that fit the wire: SENSE_IN and DRIVE, 14 bytes each (docs/link.md)."""
SENSE_PERIOD_S = {115_200: 0.0013, 500_000: 0.0003}
SIZE = NetworkSize(6, 0, 1)
TICKS = 300
REPEATS = 3
EXPERIMENT = """
task: {{type: goal_reach, max_steps: {ticks}, headings_deg: [180], start_m: [0.3, 0.3]}}
robot: {{type: remote, port: {port}, mode: {mode}, n_sensors: 3, n_motors: 2, tick_s: 0.02, rig: '{rig}',
        start_fields: [x_m, y_m, heading_rad]}}
controller: {{coding: sceann3, n_hidden: 2}}
algorithm: {{type: sga, population: 2, generations: 0}}
"""


class Still:
    """A body that costs nothing: the figure is the link's."""

    def __init__(self, n_sensors: int) -> None:
        self.state: NDArray[np.float32] = np.zeros(1, np.float32)
        self._sensors = np.full(n_sensors, 500, np.uint16)

    def sense(self) -> NDArray[np.uint16]:
        """The same values always."""
        return self._sensors

    def move(self, motors: tuple[int, ...]) -> EndReason | None:
        """Nothing happens."""
        return None


def run() -> list[Figure]:
    """Everything, best of three where the machine may disturb."""
    figures = []
    for baud, limit in SENSE_LIMIT.items():
        part = max(_sense_rate(baud) for _ in range(REPEATS)) / limit
        figures.append(
            Figure(f"SENSE streaming at {baud:,} baud, part of the wire", f"{part:.0%}", ">= 90 %", part >= 0.9)
        )
    for baud, limit in LOCKSTEP_LIMIT.items():
        rate = max(_hil_rate(baud) for _ in range(REPEATS))
        figures.append(
            Figure(
                f"lock-step at {baud:,} baud, part of the wire", f"{rate / limit:.0%}", ">= 75 %", rate / limit >= 0.75
            )
        )
    free = max(_hil_rate(None) for _ in range(REPEATS))
    figures.append(Figure("lock-steps/s, not paced", f"{free:,.0f}", ">= 4,000", free >= 4000))
    alone: dict[str, NDArray[np.float64]] = {}
    for mode in ("onboard", "tethered"):
        alone[mode], cpu = _fifty_hertz(mode, Viewer.NOBODY)
        p99 = float(np.percentile(alone[mode], 99))
        figures.append(Figure(f"50 Hz {mode}: motors late, p99", f"{p99:.2f} ms", "< 5 ms", p99 < 5.0))
        figures.append(Figure(f"50 Hz {mode}: host CPU", f"{cpu:.1%} of a core", "< 10 %", cpu < 0.1))
    for viewer in (Viewer.ALIVE, Viewer.STALLED, Viewer.KILLED):
        watched, _ = _fifty_hertz("tethered", viewer)
        moved_ms = float(np.median(watched) - np.median(alone["tethered"]))
        p99 = float(np.percentile(watched, 99))
        figures.append(
            Figure(
                f"50 Hz tethered, recorded, live viewer {viewer}: median moved, p99",
                f"{moved_ms:+.2f} ms, {p99:.2f} ms",
                "within 0.5 ms, < 5 ms",
                abs(moved_ms) < 0.5 and p99 < 5.0,
            )
        )
    return figures


@contextmanager
def _linked(board: PosixBoard) -> Iterator[RobotLink]:
    link = RobotLink(SceannSerialBus(str(board.port)))
    link.hello()
    upload(link, np.ones((1, SIZE.n_sources), np.int8), SIZE, Dynamics())
    try:
        yield link
    finally:
        link.close()


def _sense_rate(baud: int) -> float:
    """SENSE frames per second from an onboard trial that sends one in every tick."""
    with PosixBoard(n_sensors=6, n_motors=1, baud=baud, terminal=True) as board:
        if board.body is None:
            raise RuntimeError("the board has no body")
        server = multiprocessing.get_context("fork").Process(target=_answer, args=(board.body.socket,), daemon=True)
        server.start()
        arrivals: list[float] = []

        def listen(incoming: Incoming) -> None:
            if incoming.function == Function.SENSE:
                arrivals.append(time.perf_counter())

        with _linked(board) as link, link.exclusive(9), link.listening(listen):
            link.request(Op.ARM, arm_arguments(SENSE_PERIOD_S[baud]))
            link.request(Op.START, start_arguments(9, 3000, Mode.ONBOARD, Telemetry.SENSE))
            until_s = time.monotonic() + 1.5
            while time.monotonic() < until_s:
                link.receive(0.05)
            link.request(Op.STOP)
        server.kill()
        server.join()
    return (len(arrivals) - 1) / (arrivals[-1] - arrivals[0])


def _answer(pins: socket.socket) -> None:
    """A body as quick as can be: every query gets the same sensors."""
    pins.settimeout(None)
    answer = BODY_RECORD.pack(b"A", 0, 8000, *[500] * 12)
    part = b""
    while data := pins.recv(65536):
        data = part + data
        whole = len(data) - len(data) % BOARD_RECORD.size
        part = data[whole:]
        for place in range(0, whole, BOARD_RECORD.size):
            if data[place] == ord("Q"):
                pins.sendall(answer)


def _hil_rate(baud: int | None) -> float:
    steps = 5000 if baud is None else 800
    with PosixBoard(baud=baud, terminal=True) as board, _linked(board) as link:
        started_s = time.perf_counter()
        run_hil_trial(link, Order(7, steps, 0.02, SIZE.n_sensors, SIZE.n_motors), Still(SIZE.n_sensors))
        return steps / (time.perf_counter() - started_s)


class Viewer(StrEnum):
    """Who watches a run live."""

    NOBODY = "nobody"
    ALIVE = "alive"
    STALLED = "stalled"
    KILLED = "killed"


def _fifty_hertz(mode: str, viewer: Viewer) -> tuple[NDArray[np.float64], float]:
    """Lateness of every DRIVE at the motor driver in ms, and the host's CPU time per second, of two trials of 6 s.

    The host is a whole experiment with its journal; with a viewer the trials are recorded too.
    """
    here, there = multiprocessing.Pipe()
    robot_process = multiprocessing.get_context("fork").Process(target=_be_a_robot, args=(there,), daemon=True)
    robot_process.start()
    port, rig = here.recv()
    config = parse_config(EXPERIMENT.format(mode=mode, port=port, rig=rig, ticks=TICKS), "benchmark")
    with (
        tempfile.TemporaryDirectory(prefix="sceann-bench-") as folder,
        Experiment.create(config, Path(folder) / "run") as experiment,
        config.robot.build() as robot,
        _watched(robot, experiment.directory, viewer),
    ):
        cpu_s, started_s = time.process_time(), time.perf_counter()
        experiment.evolve(robot)
        cpu = (time.process_time() - cpu_s) / (time.perf_counter() - started_s)
    here.send("done")
    trials_us = here.recv()
    robot_process.join()
    late = []
    for drives_us in trials_us:
        offsets = np.array(drives_us, np.float64) - np.arange(len(drives_us)) * 20_000.0
        late.append((offsets - offsets.min()) / 1000.0)
    return np.concatenate(late), cpu


@contextmanager
def _watched(robot: Robot, directory: Path, viewer: Viewer) -> Iterator[None]:
    if viewer is Viewer.NOBODY:
        yield
        return
    recorder, feed = RecorderProcess(directory), LiveFeed(directory, str(directory / "live.rrd"))
    recorder.start()
    time.sleep(3.0)  # the viewer's process starts before the robot does
    if viewer is not Viewer.ALIVE:
        os.kill(feed.pid, signal.SIGSTOP if viewer is Viewer.STALLED else signal.SIGKILL)
    robot.observe(feed)
    yield
    robot.observe(None)
    feed.close(timeout_s=0.0)
    recorder.stop()


def _wheels() -> DifferentialDrive:
    return DifferentialDrive(
        DifferentialDriveConfig(n_sensors=3, tick_s=0.02, arena_m=(10.0, 10.0), target_m=(9.0, 9.0))
    )


def _be_a_robot(pipe: Connection) -> None:
    with VirtualPosix(VirtualBody(_wheels())) as virtual:
        pipe.send((virtual.port, virtual.rig.address if virtual.rig else None))
        pipe.recv()
        trials: list[list[int]] = [[]]
        for record in virtual.driver_log:
            if record.kind is RecordKind.DRIVE:
                trials[-1].append(record.time_us)
            elif trials[-1]:
                trials.append([])
        pipe.send([drives for drives in trials if drives])

"""The robot link: how near to the wire's limit, how punctual, and what it costs the host."""

from __future__ import annotations

import multiprocessing
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection

import numpy as np
from figures import Figure
from numpy.typing import NDArray

from backends.diffdrive import DifferentialDrive
from backends.emulation.body import VirtualBody
from backends.emulation.posix import BOARD_RECORD, BODY_RECORD, PosixBoard
from backends.emulation.virtual_posix import VirtualPosix
from backends.link.lockstep import run_lockstep
from backends.link.messages import Function, Mode, Op, Telemetry, start_arguments
from backends.link.serial_bus import SceannSerialBus
from backends.link.session import Incoming, RobotLink
from backends.link.trial import Order
from backends.link.upload import upload
from backends.remote import RemoteConfig
from sceann_hil.coding import NetworkSize
from sceann_hil.controller import Dynamics
from sceann_hil.robot import EndReason, Trials

SENSE_LIMIT = {115_200: 823.0, 500_000: 500_000 / 140}
"""SENSE frames per second that fit the wire: 14 bytes of 10 bits (docs/link.md)."""
LOCKSTEP_LIMIT = {115_200: 440.0, 500_000: 1900.0}
"""Lock-steps per second as docs/link.md states them."""
SENSE_PERIOD_S = {115_200: 0.0013, 500_000: 0.0003}
SIZE = NetworkSize(6, 0, 1)
TICKS = 500
REPEATS = 3


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
        rate = max(_lockstep_rate(baud) for _ in range(REPEATS))
        figures.append(
            Figure(
                f"lock-step at {baud:,} baud, part of the wire", f"{rate / limit:.0%}", ">= 75 %", rate / limit >= 0.75
            )
        )
    free = max(_lockstep_rate(None) for _ in range(REPEATS))
    figures.append(Figure("lock-steps/s, not paced", f"{free:,.0f}", ">= 4,000", free >= 4000))
    for mode in ("onboard", "tethered"):
        lateness_ms, cpu = _fifty_hertz(mode)
        p99 = float(np.percentile(lateness_ms, 99))
        figures.append(Figure(f"50 Hz {mode}: motors late, p99", f"{p99:.2f} ms", "< 5 ms", p99 < 5.0))
        figures.append(Figure(f"50 Hz {mode}: host CPU", f"{cpu:.1%} of a core", "< 10 %", cpu < 0.1))
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
            link.request(Op.ARM)
            link.request(Op.START, start_arguments(9, 3000, SENSE_PERIOD_S[baud], Mode.ONBOARD, Telemetry.SENSE))
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


def _lockstep_rate(baud: int | None) -> float:
    steps = 5000 if baud is None else 800
    with PosixBoard(baud=baud, terminal=True) as board, _linked(board) as link:
        started_s = time.perf_counter()
        run_lockstep(link, Order(7, steps, 0.02, SIZE.n_sensors, SIZE.n_motors), Still(SIZE.n_sensors))
        return steps / (time.perf_counter() - started_s)


def _fifty_hertz(mode: str) -> tuple[NDArray[np.float64], float]:
    """Lateness of every DRIVE at the motor driver in ms, and the host's CPU time per second, of a trial of 10 s."""
    here, there = multiprocessing.Pipe()
    robot_process = multiprocessing.get_context("fork").Process(target=_be_a_robot, args=(there,), daemon=True)
    robot_process.start()
    port, rig = here.recv()
    spec = _wheels().spec
    config = RemoteConfig(
        port=port,
        mode="onboard" if mode == "onboard" else "tethered",
        n_sensors=3,
        n_motors=2,
        tick_s=0.02,
        start_fields=spec.start_fields,
        rig=rig,
    )
    size = NetworkSize(3, 0, 2)
    trial = Trials(
        size=size,
        dynamics=Dynamics(),
        weights=np.array([[[1, 0, 0, -1, 0], [0, 0, 1, 0, -1]]], np.int8),
        genome_index=np.zeros(1, np.int32),
        starts=np.array([[0.3, 0.3, 3.0]]),
        keys=np.zeros(1, np.uint64),
        max_steps=TICKS,
        ids=np.array([1]),
    )
    with config.build() as robot:
        cpu_s, started_s = time.process_time(), time.perf_counter()
        results = robot.run(trial)
        cpu = (time.process_time() - cpu_s) / (time.perf_counter() - started_s)
        if EndReason(results.end_reasons[0]).is_void:
            raise RuntimeError(f"the trial was void: {robot.health().messages}")
    here.send("done")
    drives_us = np.array(here.recv(), np.float64)
    robot_process.join()
    schedule = np.arange(len(drives_us)) * 20_000.0
    offsets = drives_us - schedule
    return (offsets - offsets.min()) / 1000.0, cpu


def _wheels() -> DifferentialDrive:
    return DifferentialDrive(n_sensors=3, tick_s=0.02, arena_m=(10.0, 10.0), target_m=(9.0, 9.0))


def _be_a_robot(pipe: Connection) -> None:
    with VirtualPosix(VirtualBody(_wheels())) as virtual:
        pipe.send((virtual.port, virtual.rig.address if virtual.rig else None))
        pipe.recv()
        pipe.send([record.time_us for record in virtual.driver_log if record.motors])

"""From a press on the web panel to the robot's safe output, on the virtual robot (firmware, line and motor driver).

And to the answer, beside a crowd of strangers who want the panel for themselves.
"""

from __future__ import annotations

import http.client
import json
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
from figures import Figure

from backends.cartpole import CartPole
from backends.remote import RemoteConfig, RemoteRobot
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.firmware.emulated.posix import RecordKind
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import Trials
from sceann_hil.supervision.operators import Desk, Phase, Situation, Verb
from sceann_hil.supervision.operators.web import WebPanel

PRESSES = 25
STRANGERS = ("2000", "50", "20")
"""Idle, slow and flooding connections."""
SIZE = NetworkSize(2, 1, 1)
FIELDS = ("x_m", "velocity_m_s", "angle_rad", "angular_velocity_rad_s")


def run() -> list[Figure]:
    """Stop and emergency stop, each pressed in a running trial."""
    figures = []
    with VirtualPosix(VirtualBody(CartPole()), baud=115_200) as virtual:
        config = RemoteConfig(port=virtual.port, n_sensors=2, n_motors=1, tick_s=0.02, start_fields=FIELDS)
        with config.build() as robot:
            latencies = [_press(virtual, robot, number, Verb.STOP) for number in range(1, PRESSES + 1)]
        worst_ms, median_ms = 1e3 * max(latencies), 1e3 * float(np.median(latencies))
        figures.append(
            Figure(
                f"press to safe motors, {PRESSES} presses at 115,200 baud",
                f"median {median_ms:.1f} ms, worst {worst_ms:.1f} ms",
                "< 100 ms",
                worst_ms < 100,
            )
        )
        stops = []
        for number in range(101, 104):
            with config.build() as robot:
                stops.append(_press(virtual, robot, number, Verb.EMERGENCY_STOP))
        worst_ms = 1e3 * max(stops)
        figures.append(Figure("the same, emergency stop", f"worst {worst_ms:.1f} ms", "< 100 ms", worst_ms < 100))
    return [*figures, *_beside_strangers()]


def _beside_strangers() -> list[Figure]:
    """STOP over a new connection and over the one that the page keeps open, with and without strangers."""
    figures = []
    desk = Desk()
    with WebPanel(desk, "127.0.0.1", 0) as panel:
        alone_ms = _answers_ms(panel)
        command = [sys.executable, str(Path(__file__).with_name("panel_crowd.py")), str(panel.port), *STRANGERS]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as crowd:
            assert crowd.stdout is not None
            crowd.stdout.readline()
            time.sleep(1.0)
            beside_ms = _answers_ms(panel)
            crowd.communicate("", timeout=30)
    for what, alone, beside in zip(("a kept connection", "a new connection"), alone_ms, beside_ms, strict=True):
        idle, slow, flooding = STRANGERS
        figures.append(
            Figure(
                f"STOP answered over {what} beside {idle} idle, {slow} slow, {flooding} flooding ones",
                f"median {np.median(beside):.1f} ms, worst {max(beside):.1f} ms (alone {np.median(alone):.1f} ms)",
                "< 100 ms",
                max(beside) < 100,
            )
        )
    return figures


def _answers_ms(panel: WebPanel) -> tuple[list[float], list[float]]:
    kept = http.client.HTTPConnection("127.0.0.1", panel.port, timeout=30)
    times: tuple[list[float], list[float]] = ([], [])
    for _ in range(PRESSES):
        times[0].append(_answer_ms(kept, panel))
        new = http.client.HTTPConnection("127.0.0.1", panel.port, timeout=30)
        times[1].append(_answer_ms(new, panel))
        new.close()
        time.sleep(0.05)
    kept.close()
    return times


def _answer_ms(connection: http.client.HTTPConnection, panel: WebPanel) -> float:
    stopped = threading.Event()

    def trial() -> None:
        with panel.desk.flight(Situation(0, 0, 0, 0, ""), lambda _: stopped.set()):
            stopped.wait(60)

    thread = threading.Thread(target=trial)
    thread.start()
    while panel.desk.view().phase is not Phase.RUNNING:
        time.sleep(0.001)
    cookie = f"{panel.access.cookie}={panel.access.token}"
    pressed_s = time.perf_counter()
    connection.request("POST", "/press", '{"verb": "stop"}', {"Content-Type": "application/json", "Cookie": cookie})
    answer = connection.getresponse()
    answer.read()
    answered_s = time.perf_counter()
    thread.join()
    if answer.status != 200:
        raise RuntimeError(f"STOP was answered {answer.status}")
    return 1e3 * (answered_s - pressed_s)


def _press(virtual: VirtualPosix, robot: RemoteRobot, number: int, verb: Verb) -> float:
    if virtual.body is not None:
        virtual.body.place([0.0] * 4)
    desk = Desk()

    def trial() -> None:
        with desk.flight(Situation(0, 0, 0, 0, ""), robot.interrupt):
            robot.run(_trials(number))

    with WebPanel(desk, "127.0.0.1", 0) as panel:
        cookie = f"{panel.access.cookie}={panel.access.token}"
        headers = {"Content-Type": "application/json", "Cookie": cookie}
        thread = threading.Thread(target=trial)
        thread.start()
        time.sleep(0.4)
        connection = http.client.HTTPConnection("127.0.0.1", panel.port)
        connection.connect()
        virtual.driver_log.clear()
        pressed_s = time.perf_counter()
        connection.request("POST", "/press", json.dumps({"verb": verb}), headers)
        while not any(record.kind is RecordKind.SAFE for record in list(virtual.driver_log)):
            if time.perf_counter() - pressed_s > 5.0:
                raise RuntimeError(f"{verb}: the motors were not safe after 5 s")
            time.sleep(0.0005)
        latency_s = time.perf_counter() - pressed_s
        connection.close()
        thread.join()
    return latency_s


def _trials(number: int) -> Trials:
    bits = np.zeros((1, Coding.SCEANN2.genome_length(SIZE)), np.uint8)
    return Trials(
        size=SIZE,
        dynamics=Dynamics(),
        weights=Coding.SCEANN2.decode(bits, SIZE),
        genome_index=np.zeros(1, np.int32),
        starts=np.zeros((1, 4)),
        keys=np.ones(1, np.uint64),
        max_steps=60_000,
        ids=np.array([number]),
    )

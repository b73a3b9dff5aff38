"""A posix board with a body that answers from a thread, and a client in charge of it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from sceann_hil.firmware.emulated.posix import Alarm, BoardRecord, PosixBoard, RecordKind
from sceann_hil.link.vocabulary import Mode, Op, Telemetry
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.image import ControllerImage
from tests.link.oracle import Message, RobotClient

N_SENSORS, N_MOTORS = 3, 2
TICK_S = 0.02
STATE = {"IDLE": 1, "LOADED": 2, "ARMED": 3, "RUNNING": 4, "SAFE": 5, "ESTOP": 6}
REASON = {
    "MAX_TICKS": 0,
    "LINK_LOST": 16,
    "BATTERY": 17,
    "FAULT": 19,
    "ESTOP": 20,
    "OVERRUN": 21,
    "STOPPED": 32,
    "BUMPER": 33,
}
SENSORS = [100, 500, 900]


def an_image(n_sensors: int = N_SENSORS, n_motors: int = N_MOTORS, seed: int = 1) -> ControllerImage:
    size = NetworkSize(n_sensors, 2, n_motors)
    genome = np.random.default_rng(seed).integers(0, 2, Coding.SCEANN2.genome_length(size)).astype(np.uint8)
    return ControllerImage(genome, Coding.SCEANN2, size)


class Rig:
    """Board, body and client. The body answers every query until `mute`, and keeps what the motor driver saw."""

    def __init__(self, store: Path | None = None) -> None:
        self.board = PosixBoard(n_sensors=N_SENSORS, n_motors=N_MOTORS, store=store)
        self.records: list[BoardRecord] = []
        self.mute = False
        self.alarms = Alarm.NONE
        self._end = False
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        assert self.board.line is not None
        self.client = RobotClient(self.board.line)

    def _serve(self) -> None:
        assert self.board.body is not None
        while not self._end:
            try:
                records = self.board.body.records(0.05)
            except (EOFError, OSError):
                return
            self.records += records
            if not self.mute:
                for record in records:
                    if record.kind is RecordKind.QUERY:
                        self.board.body.answer(SENSORS, 7400, self.alarms)

    def raise_alarm(self, alarm: Alarm) -> None:
        self.alarms = alarm
        assert self.board.body is not None
        self.board.body.tell(SENSORS, 7400, alarm)

    def ready(self, image: ControllerImage | None = None) -> RobotClient:
        self.client.hello()
        self.client.upload(image or an_image())
        return self.client

    def start(
        self, trial_id: int = 1, max_ticks: int = 1000, mode: Mode = Mode.ONBOARD, telemetry: int = 0
    ) -> RobotClient:
        client = self.ready()
        client.start(trial_id, max_ticks, mode, TICK_S, Telemetry(telemetry))
        return client

    def wait_for(self, name: str, timeout_s: float = 5.0, heartbeat: bool = True, **signals: int) -> Message:
        """The next message of this name with these signals, with heartbeats meanwhile."""

        def matches(message: Message) -> bool:
            return message.name == name and all(message.signals[key] == value for key, value in signals.items())

        events = self.client.events
        while events:
            message = events.popleft()
            if matches(message):
                return message
        end = time.monotonic() + timeout_s
        while time.monotonic() < end:
            if heartbeat:
                self.client.heartbeat()
            for message in self.client.receive(0.05):
                if matches(message):
                    return message
        raise AssertionError(f"no {name} {signals} within {timeout_s} s")

    def until(self, condition: Callable[[], bool], timeout_s: float = 5.0, heartbeat: bool = True) -> None:
        end = time.monotonic() + timeout_s
        while not condition():
            assert time.monotonic() < end, "the condition never came true"
            if heartbeat:
                self.client.heartbeat()
            time.sleep(0.01)

    def last_output(self) -> BoardRecord:
        """What the motor driver was told last."""
        return next(record for record in reversed(self.records) if record.kind is not RecordKind.QUERY)

    def motors_are_safe(self) -> bool:
        told = any(record.kind is not RecordKind.QUERY for record in self.records)
        return told and self.last_output().kind is RecordKind.SAFE

    def driven(self) -> list[tuple[int, ...]]:
        return [record.motors for record in self.records if record.kind is RecordKind.DRIVE]

    def last(self) -> tuple[int, int]:
        reply = self.client.request(Op.LAST)
        return reply["LastTrialId"], reply["LastReason"]

    def close(self) -> None:
        self._end = True
        self.board.power_off()
        self._thread.join()
        self.board.close()

"""Doing something to a host, a robot or their cable in a chosen phase of a trial, and what must hold afterwards."""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from threading import Event

import pytest

from sceann_hil.firmware.emulated.posix import BoardRecord, RecordKind
from sceann_hil.journal import JOURNAL_NAME, Journal
from sceann_hil.link.session import RobotLink
from sceann_hil.link.vocabulary import Function, Op

SAFE_WITHIN_US = 350_000

PHASES = ["HELLO", "LOAD", "GENOME", "COMMIT", "ARM", "START", "TICK", "LATE TICK", "STOP", "RESULT"]
"""Right after the host sent this message (TICK: in the middle of a trial); RESULT: before the result is journalled."""


def in_phase(monkeypatch: pytest.MonkeyPatch, phase: str, strike: Callable[[], None], occurrence: int = 2) -> Event:
    """Call `strike` once, when a host of this process comes to the phase for the `occurrence`-th time.

    Returns:
        Set when it has struck.
    """
    struck = Event()
    left = {"TICK": 4, "LATE TICK": 9}.get(phase, 1 if phase in ("HELLO", "RESULT") else occurrence)
    original_send, original_record = RobotLink.send, Journal.record

    def reached(link: RobotLink, function: Function, data: bytes) -> bool:
        if phase in ("TICK", "LATE TICK"):
            in_trial = function is Function.HOST_HEARTBEAT and link._trial_id != 0
            return function in (Function.SENSE_IN, Function.DRIVE_IN) or in_trial
        if phase == "GENOME":
            return function is Function.GENOME
        return function is Function.COMMAND and Op(data[0] & 15).name == phase

    def send(self: RobotLink, function: Function, data: bytes = b"") -> None:
        nonlocal left
        original_send(self, function, data)
        if phase != "RESULT" and left > 0 and reached(self, function, data):
            left -= 1
            if left == 0:
                struck.set()
                strike()

    def record(self: Journal, *arguments: object) -> None:
        nonlocal left
        if phase == "RESULT" and left > 0:
            left -= 1
            struck.set()
            strike()
        original_record(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(RobotLink, "send", send)
    monkeypatch.setattr(Journal, "record", record)
    return struck


def now_us() -> int:
    """The clock of the board's records."""
    return time.monotonic_ns() // 1000 & 0xFFFFFFFF


def assert_motors_safe(log: Iterable[BoardRecord], fault_us: int, unpowered: bool = False) -> None:
    """What the motor driver got: from 350 ms after the fault on the safe output, until a new trial drives it.

    Args:
        log: of the motor driver.
        fault_us: when the fault struck.
        unpowered: the board lost its power, so that pull-downs hold the driver safe until it starts again.
    """
    records = list(log)
    before = [r for r in records if (fault_us - r.time_us) % 2**32 < 2**31]
    after = records[len(before) :]
    if unpowered or not before or before[-1].kind is RecordKind.SAFE:
        driven = [r for r in after if r.kind is RecordKind.DRIVE]
        if driven and not unpowered:
            # it was at rest: whatever drives it now is a trial that started after the fault
            assert (driven[0].time_us - fault_us) % 2**32 < 2**31
        return
    safe = next((r for r in after if r.kind is RecordKind.SAFE), None)
    assert safe is not None, "the motors were never made safe"
    assert (safe.time_us - fault_us) % 2**32 <= SAFE_WITHIN_US


def without_motion(results: list[tuple[object, ...]]) -> list[tuple[object, ...]]:
    """Which trials were counted: all that a late tick of a tethered robot, whose motors hold on, leaves as it is."""
    return [row[:3] for row in results]


COUNTED = (
    "SELECT generation, individual, trial, end_reason, steps, state_hash, fitness FROM attempt "
    "WHERE fitness IS NOT NULL ORDER BY generation, individual, trial"
)


def counted_results(directory: Path) -> list[tuple[object, ...]]:
    """The one counted result of every (individual, trial)."""
    db = sqlite3.connect(directory / JOURNAL_NAME)
    try:
        assert db.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert not db.execute("PRAGMA foreign_key_check").fetchall()
        void = "('link_lost', 'battery', 'operator', 'fault', 'emergency_stop', 'overrun')"
        assert not db.execute(f"SELECT id FROM attempt WHERE end_reason IN {void} AND fitness IS NOT NULL").fetchall()
        doubles = (
            "SELECT 1 FROM attempt WHERE fitness IS NOT NULL GROUP BY generation, individual, trial HAVING count(*) > 1"
        )
        assert not db.execute(doubles).fetchall()
        return db.execute(COUNTED).fetchall()
    finally:
        db.close()

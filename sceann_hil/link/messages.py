"""The link's messages as bytes: what ``firmware/sceann.dbc`` defines, packed with `struct` for the hot loop.

``docs/link.md`` explains every field; a test holds each function here against the DBC through cantools.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Self

from sceann_hil.link.vocabulary import CHUNK_BYTES, LINK_VERSION, MAX_MOTORS, Function, Mode, Op, Telemetry
from sceann_hil.robot import EndReason

NO_HASH = 0xFFFF
"""END's state hash where the robot computed no neuron (tethered)."""


class LinkEnd(IntEnum):
    """Why a trial ended, as the robot says it. Numbers below 32 are those of `EndReason`."""

    MAX_TICKS = EndReason.TIME_UP
    LINK_LOST = EndReason.LINK_LOST
    BATTERY = EndReason.BATTERY
    FAULT = EndReason.FAULT
    EMERGENCY_STOP = EndReason.EMERGENCY_STOP
    OVERRUN = EndReason.OVERRUN
    STOPPED = 32
    """By STOP, which the host sent because the task had ended or somebody asked."""
    BUMPER = 33
    UNFINISHED = 255
    """Begun, no end known: the robot lost power."""


_HELLO = struct.Struct("<BHI")
_COMMIT = struct.Struct("<IHx")
_START = struct.Struct("<HHHB")
_STORE = struct.Struct("<BHxxxx")
_EVENT = struct.Struct("<BBHHH")
_END = struct.Struct("<HBHH")
_HEARTBEAT = struct.Struct("<BIHB")
_HOST_HEARTBEAT = struct.Struct("<BHH")
_NEURON_STATES = struct.Struct("<BBhhh")
_SENSORS = struct.Struct("<Q")
_DRIVE = [struct.Struct(f"<BB{n}H") for n in range(MAX_MOTORS + 1)]


def identifier(function: Function, node: int) -> int:
    """The 11-bit CAN identifier of a message to or from `node`; ESTOP is for all nodes."""
    return 0 if function is Function.ESTOP else function + node


def pack_sensors(sensors: Sequence[int], tick: int) -> bytes:
    """One page of SENSE or SENSE_IN: up to 6 values 0..1023 and the low 4 bits of the tick."""
    word = (tick & 15) << 60
    shift = 0
    for value in sensors:
        word |= value << shift
        shift += 10
    return _SENSORS.pack(word)


def unpack_sensors(data: bytes) -> tuple[int, tuple[int, int, int, int, int, int]]:
    """The low 4 bits of the tick and six values of one page."""
    word = int.from_bytes(data, "little")
    return word >> 60, (
        word & 1023,
        word >> 10 & 1023,
        word >> 20 & 1023,
        word >> 30 & 1023,
        word >> 40 & 1023,
        word >> 50 & 1023,
    )


def pack_drive(tick: int, state_hash: int, motors: Sequence[int]) -> bytes:
    """DRIVE_IN (or DRIVE): the low 8 bits of tick and hash, and up to 3 motor values in Q10."""
    return _DRIVE[len(motors)].pack(tick & 255, state_hash & 255, *motors)


def unpack_drive(data: bytes) -> tuple[int, int, tuple[int, ...]]:
    """Low 8 bits of the tick, low 8 bits of the state hash, motors in Q10."""
    tick, state_hash, *motors = _DRIVE[(len(data) - 2) // 2].unpack_from(data)
    return tick, state_hash, tuple(motors)


def unpack_states(data: bytes) -> tuple[int, int, tuple[int, int, int]]:
    """First neuron, low 8 bits of the tick, and three neuron states u."""
    first, tick, a, b, c = _NEURON_STATES.unpack(data)
    return first, tick, (a, b, c)


def pack_chunk(index: int, chunk: bytes) -> bytes:
    """GENOME: up to seven bytes of the genome."""
    return bytes((index,)) + chunk.ljust(CHUNK_BYTES, b"\0")


def pack_command(op: Op, sequence: int, arguments: bytes = b"") -> bytes:
    """COMMAND with at most seven bytes of arguments."""
    return bytes((op | sequence << 4,)) + arguments.ljust(7, b"\0")


def hello_arguments(session: int, arithmetic_id: int) -> bytes:
    """HELLO: session 1..65535, drawn anew by every host process."""
    return _HELLO.pack(LINK_VERSION, session, arithmetic_id)


def commit_arguments(record_crc: int, initial_output: int) -> bytes:
    """COMMIT: CRC-32 of the genome record, and x_i(0) in Q10."""
    return _COMMIT.pack(record_crc, initial_output)


def start_arguments(trial_id: int, max_ticks: int, tick_s: float, mode: Mode, telemetry: Telemetry) -> bytes:
    """START: trial id 1..65535, at most `max_ticks` ticks of `tick_s` (resolution 0.1 ms)."""
    return _START.pack(trial_id, max_ticks, round(tick_s * 10_000), mode | telemetry << 4)


def store_arguments(action: int, autorun_tick_s: float = 0.0) -> bytes:
    """STORE: 0 erase, 1 keep, 2 keep and run without a host at `autorun_tick_s`."""
    return _STORE.pack(action, round(autorun_tick_s * 10_000))


def host_heartbeat(trial_id: int, session: int) -> bytes:
    """HOST_HEARTBEAT; trial id 0 when no trial runs."""
    return _HOST_HEARTBEAT.pack(int(trial_id != 0), trial_id, session)


@dataclass(frozen=True, slots=True)
class Event:
    """Something happened on the robot."""

    code: int
    state: int
    tick: int
    argument: int
    trial_id: int

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """From EVENT's eight bytes."""
        return cls(*_EVENT.unpack(data))


@dataclass(frozen=True, slots=True)
class End:
    """How a trial ended: END, also the first half of the answer to LAST.

    Attributes:
        trial_id: 0 if the robot remembers no trial.
        reason: why.
        ticks: control steps done.
        state_hash: CRC-16 over all neuron states; `NO_HASH` of a tethered trial.
    """

    trial_id: int
    reason: LinkEnd
    ticks: int
    state_hash: int

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """From END's seven bytes.

        Raises:
            ValueError: an end reason that this link version does not have.
        """
        trial_id, reason, ticks, state_hash = _END.unpack(data)
        return cls(trial_id, LinkEnd(reason), ticks, state_hash)


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """The robot is alive."""

    state: int
    uptime_ms: int
    battery_mv: int
    receive_errors: int

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """From HEARTBEAT's eight bytes."""
        return cls(*_HEARTBEAT.unpack(data))


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to a request; `data` holds the op's own six bytes."""

    op: int
    sequence: int
    status: int
    data: bytes

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """From REPLY's eight bytes."""
        return cls(data[0] & 15, data[0] >> 4, data[1], bytes(data[2:8]))

    def u32(self) -> int:
        """COMMIT's, STORE's and STORED's CRC-32."""
        return int.from_bytes(self.data[:4], "little")

    @property
    def missing_chunk(self) -> int:
        """COMMIT's first missing chunk."""
        return self.data[4]

"""The link's messages as bytes: what ``firmware/sceann.dbc`` defines, packed with `struct` for the hot loop.

``docs/link.md`` explains every field; a test holds each function here against the DBC through cantools.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Self

from sceann_hil.link.numbers import CHUNK_BYTES, LINK_VERSION, MAX_MOTORS
from sceann_hil.link.vocabulary import Function, Mode, Op, StoreAction, Telemetry
from sceann_hil.network.controller import ONE
from sceann_hil.network.image import CODING_NUMBER, NEURON_NUMBER, ControllerImage
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


_COMMAND = struct.Struct("<B5sH")
_HELLO = struct.Struct("<BI")
_LOAD = struct.Struct("<BBBH")
_COMMIT = struct.Struct("<Ix")
_ARM = struct.Struct("<Hxxx")
_START = struct.Struct("<HHB")
_STORE = struct.Struct("<BHxx")
_EVENT = struct.Struct("<BBHHH")
_END = struct.Struct("<HBHH")
_HEARTBEAT = struct.Struct("<BIHB")
_HOST_HEARTBEAT = struct.Struct("<BHH")
_NEURON_STATES = struct.Struct("<BBhhh")
_SENSORS = struct.Struct("<Q")
_DRIVE = struct.Struct(f"<BB{MAX_MOTORS}H")


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


def pack_drive(tick: int, low_byte: int, motors: Sequence[int]) -> bytes:
    """DRIVE_IN (or DRIVE): the low 8 bits of the tick and of the session (or the state hash), motor values in Q10."""
    return _DRIVE.pack(tick & 255, low_byte & 255, *motors, *(0,) * (MAX_MOTORS - len(motors)))


def unpack_drive(data: bytes, n_motors: int) -> tuple[int, int, tuple[int, ...]]:
    """Low 8 bits of the tick, low 8 bits of the state hash, `n_motors` motors in Q10.

    Raises:
        ValueError: a motor value that no neuron can have.
    """
    tick, low_byte, *motors = _DRIVE.unpack(data)
    if max(motors) > ONE:
        raise ValueError(f"DRIVE: expected motors 0..{ONE}, got {motors}")
    return tick, low_byte, tuple(motors[:n_motors])


def unpack_states(data: bytes) -> tuple[int, int, tuple[int, int, int]]:
    """First neuron, low 8 bits of the tick, and three neuron states u."""
    first, tick, a, b, c = _NEURON_STATES.unpack(data)
    return first, tick, (a, b, c)


def pack_chunk(index: int, chunk: bytes) -> bytes:
    """GENOME: up to seven bytes of the genome."""
    return bytes((index,)) + chunk.ljust(CHUNK_BYTES, b"\0")


def pack_command(op: Op, sequence: int, session: int, arguments: bytes = b"") -> bytes:
    """COMMAND with at most five bytes of arguments."""
    return _COMMAND.pack(op | sequence << 4, arguments, session)


def hello_arguments(arithmetic_id: int) -> bytes:
    """HELLO: what this host speaks and computes."""
    return _HELLO.pack(LINK_VERSION, arithmetic_id)


def load_arguments(image: ControllerImage) -> bytes:
    """LOAD: everything about a network but the bits of its genome."""
    size, dynamics = image.size, image.dynamics
    kind = CODING_NUMBER[image.coding] | NEURON_NUMBER[dynamics.neuron] << 4
    return _LOAD.pack(kind, size.n_sensors | size.n_motors << 4, size.n_hidden, dynamics.initial_output)


def commit_arguments(record_crc: int) -> bytes:
    """COMMIT: CRC-32 of the genome record."""
    return _COMMIT.pack(record_crc)


def wire_period(tick_s: float) -> int:
    """A control period in the link's unit of 0.1 ms."""
    return round(tick_s * 10_000)


def arm_arguments(tick_s: float) -> bytes:
    """ARM: the control period of the trial to come; of no account in mode HIL."""
    return _ARM.pack(wire_period(tick_s))


def start_arguments(trial_id: int, max_ticks: int, mode: Mode, telemetry: Telemetry) -> bytes:
    """START: trial id 1..65535, at most `max_ticks` ticks."""
    return _START.pack(trial_id, max_ticks, mode | telemetry << 4)


def store_arguments(action: StoreAction, autorun_tick_s: float = 0.0) -> bytes:
    """STORE; the control period is that of `StoreAction.AUTORUN` and `StoreAction.BUTTON`."""
    return _STORE.pack(action, wire_period(autorun_tick_s))


def node_arguments(new_node: int) -> bytes:
    """NODE: the robot's number from now on, 1..127."""
    return bytes((new_node,))


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

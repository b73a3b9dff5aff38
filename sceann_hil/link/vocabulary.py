"""The words of the link (``docs/link.md``): what host and firmware call things. Its numbers are in `numbers`."""

from __future__ import annotations

from enum import IntEnum, IntFlag


class Function(IntEnum):
    """The upper bits of an identifier: function + node. Lower numbers win the bus."""

    ESTOP = 0x000
    EVENT = 0x080
    END = 0x100
    SENSE = 0x180
    SENSE_IN = 0x200
    DRIVE = 0x280
    DRIVE_IN = 0x300
    GENOME = 0x380
    COMMAND = 0x400
    REPLY = 0x480
    DESCRIPTOR = 0x500
    SENSE_PAGE2 = 0x580
    SENSE_IN_PAGE2 = 0x600
    HOST_HEARTBEAT = 0x680
    HEARTBEAT = 0x700
    NEURON_STATES = 0x780


class Op(IntEnum):
    """Requests."""

    HELLO = 1
    LOAD = 2
    COMMIT = 3
    ARM = 4
    START = 5
    STOP = 6
    CLEAR = 7
    STORE = 8
    LAST = 9
    STORED = 10
    NODE = 11


class Status(IntEnum):
    """What a reply says."""

    OK = 0
    BAD_STATE = 1
    BAD_ARGUMENT = 2
    NO_SESSION = 3
    OTHER_HOST = 4
    LINK_VERSION = 5
    ARITHMETIC = 6
    TOO_LARGE = 7
    MISSING_CHUNK = 8
    BAD_CRC = 9
    NO_GENOME = 10
    WRONG_SIZE = 11
    ALREADY_RUN = 12
    STORE_FAILED = 13
    UNSUPPORTED = 14
    ALARM = 15
    UNKNOWN_OP = 16


class StoreAction(IntEnum):
    """What STORE does with the network in use."""

    ERASE = 0
    KEEP = 1
    AUTORUN = 2
    """Kept, and run after a start without a host."""
    BUTTON = 3
    """Kept, and run when the start button is pressed."""


class State(IntEnum):
    """The robot's states. Motors are driven in RUNNING only."""

    BOOT = 0
    IDLE = 1
    LOADED = 2
    ARMED = 3
    RUNNING = 4
    SAFE = 5
    ESTOP = 6


class Mode(IntEnum):
    """Where controller and body are during a trial."""

    ONBOARD = 0
    TETHERED = 1
    HIL = 2


class Telemetry(IntFlag):
    """What the robot sends in every tick without being asked."""

    NONE = 0
    SENSE = 1
    DRIVE = 2
    STATES = 4


class EventCode(IntEnum):
    """What an EVENT tells."""

    BOOT = 1
    STATE_CHANGE = 2
    OVERRUN = 3
    BUMPER = 4
    BATTERY_LOW = 5
    FAULT = 6
    TICK_MISMATCH = 7
    STORE_FAILED = 8
    NO_AUTORUN = 9

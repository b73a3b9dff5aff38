"""A second, independent reading of the link's specification: a small host that packs everything with cantools.

What the product's host side (`sceann_hil.link`) and the firmware pack by hand is held against ``firmware/sceann.dbc``
by this one. The line is anything with `Line`'s two methods: a socket, or an emulated chip, whose time-outs are those of
its own clock.
"""

from __future__ import annotations

import secrets
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import cantools
import numpy as np
from cantools.database.can import Database
from numpy.typing import NDArray

from sceann_hil.firmware.build import FIRMWARE
from sceann_hil.link.descriptor import PAGES, Descriptor
from sceann_hil.link.framed_bus import Line
from sceann_hil.link.framing import Deframer, encode_frame
from sceann_hil.link.numbers import CHUNK_BYTES, LINK_VERSION
from sceann_hil.link.vocabulary import Mode, Op, Status, StoreAction, Telemetry
from sceann_hil.network.controller import ARITHMETIC_ID, ONE
from sceann_hil.network.image import CODING_NUMBER, NEURON_NUMBER, ControllerImage
from sceann_hil.robot import LinkError

REPLY_TIMEOUT_S = 0.3
"""Longest time between a command and its reply, but for STORE."""
STORE_TIMEOUT_S = 1.5
"""An AVR's EEPROM takes 140 bytes at 3.4 ms."""
TRIES = 6
STEP_TIMEOUT_S = 0.1
"""Before a lock-step is repeated: short enough to send heartbeats meanwhile."""
STEP_TRIES = 20


@dataclass(frozen=True, slots=True)
class Message:
    """A decoded message.

    Attributes:
        name: in the DBC.
        signals: raw values.
        data: its bytes as they came.
    """

    name: str
    signals: dict[str, int]
    data: bytes


class Refused(LinkError):
    """The robot answered a request with another status than OK.

    Attributes:
        status: what it said.
        reply: the whole reply.
    """

    def __init__(self, op: Op, status: Status, reply: dict[str, int]) -> None:
        super().__init__(f"{op.name}: the robot refuses, {status.name}")
        self.status = status
        self.reply = reply


class NoAnswer(LinkError):
    """Nothing came in time, or not what was asked for."""


@cache
def database() -> Database:
    """The messages of ``firmware/sceann.dbc``, with identifiers for node 1."""
    loaded = cantools.database.load_file(FIRMWARE / "sceann.dbc")
    if not isinstance(loaded, Database):
        raise TypeError(f"sceann.dbc: expected a CAN database, got {type(loaded).__name__}")
    return loaded


def defaults(op: Op) -> dict[str, int]:
    """Arguments that most tests do not care about."""
    return {Op.ARM: {"TickPeriod": 200}, Op.STORE: {"AutorunTickPeriod": 0}}.get(op, {})


class RobotClient:
    """A host in charge of one robot.

    Attributes:
        session: the number by which the robot knows this host.
        trial_id: the trial that was started last, 0 before the first.
        events: every EVENT, END and heartbeat that came between replies, oldest first, at most 1000.
        bytes_received: everything that came, valid or not.
        frames_received: how many valid frames were in it; 0 with many bytes is another firmware or another speed.
    """

    def __init__(self, line: Line, node: int = 1, session: int | None = None) -> None:
        self.node = node
        self.session = session if session is not None else secrets.randbelow(0xFFFF) + 1
        self.events: deque[Message] = deque(maxlen=1000)
        self.trial_id = 0
        self.bytes_received = 0
        self.frames_received = 0
        self._line = line
        self._deframer = Deframer()
        self._frames: deque[tuple[int, bytes]] = deque()
        self._sequence = 0

    # -- messages ---------------------------------------------------------------------------------------------------

    def send(self, name: str, signals: dict[str, int] | None = None, length: int | None = None) -> None:
        """Packs and sends a message of the DBC (raw values), cut to `length` bytes."""
        message = database().get_message_by_name(name)
        data = bytes(message.encode(signals or {}, scaling=False, strict=False)) if message.length else b""
        identifier = message.frame_id + (self.node - 1 if message.frame_id else 0)
        self._line.write(encode_frame(identifier, data[:length]))

    def receive(self, timeout_s: float) -> Iterator[Message]:
        """Messages as they come, until `timeout_s` after the call. Broken frames and other nodes are passed over."""
        deadline = time.monotonic() + timeout_s
        while True:
            while self._frames:
                message = self._decode(*self._frames.popleft())
                if message is not None:
                    yield message
            left = deadline - time.monotonic()
            if left <= 0:
                return
            data = self._line.read(left)
            self.bytes_received += len(data)
            frames = self._deframer.feed(data)
            self.frames_received += len(frames)
            self._frames += frames

    def at_hand(self) -> list[Message]:
        """Messages that have come already."""
        self._frames += self._deframer.feed(self._line.read(0.0))
        decoded = [self._decode(*frame) for frame in self._frames]
        self._frames.clear()
        return [message for message in decoded if message is not None]

    def _decode(self, identifier: int, data: bytes) -> Message | None:
        if identifier & 0x7F != self.node:
            return None
        try:
            message = database().get_message_by_frame_id(identifier - self.node + 1)
        except KeyError:
            return None
        signals: Any = message.decode(data, decode_choices=False, scaling=False)
        return Message(message.name, {key: int(value) for key, value in signals.items()}, data)

    def expect(self, name: str, timeout_s: float = REPLY_TIMEOUT_S) -> dict[str, int]:
        """The next message of this name; others go to `events`.

        Raises:
            NoAnswer: none came in time.
        """
        for message in self.receive(timeout_s):
            if message.name == name:
                return message.signals
            self.events.append(message)
        raise NoAnswer(f"expected {name} from the robot, got nothing within {timeout_s} s")

    def request(self, op: Op, **arguments: int) -> dict[str, int]:
        """One command and its reply, repeated when nothing comes.

        Raises:
            NoAnswer: no reply after all tries.
            Refused: the robot says no.
        """
        self._sequence = (self._sequence + 1) % 16
        command = {"Op": int(op), "Sequence": self._sequence, "Session": self.session, **defaults(op), **arguments}
        for _ in range(TRIES):
            self.send("Command", command)
            for message in self.receive(STORE_TIMEOUT_S if op is Op.STORE else REPLY_TIMEOUT_S):
                reply = message.signals
                if message.name == "Reply" and (reply["Op"], reply["Sequence"]) == (op, self._sequence):
                    if reply["Status"] != Status.OK:
                        raise Refused(op, Status(reply["Status"]), reply)
                    return reply
                self.events.append(message)
        raise NoAnswer(f"{op.name}: no reply from the robot after {TRIES} tries")

    def drive_in(self, tick: int, *motors: int) -> None:
        """DRIVE_IN of one tick, as the host in charge."""
        signals = {f"Motor{k}": motors[k] if k < len(motors) else 0 for k in range(3)}
        self.send("DriveIn", {"Tick": tick % 256, "SessionLow": self.session % 256, **signals})

    # -- requests ---------------------------------------------------------------------------------------------------

    def hello(self) -> Descriptor:
        """Takes the robot and reads what it is.

        Raises:
            NoAnswer: silence, or not all pages of the descriptor.
            Refused: another host is in charge, or the versions differ.
        """
        for _ in range(TRIES):
            self.request(Op.HELLO, LinkVersion=LINK_VERSION, ArithmeticId=ARITHMETIC_ID)
            pages = self._descriptor_pages()
            if all(page in pages for page in range(PAGES)):
                return Descriptor.from_pages(pages)
        raise NoAnswer("HELLO: the robot's descriptor came only in parts")

    def _descriptor_pages(self) -> dict[int, bytes]:
        pages: dict[int, bytes] = {}
        for message in self.receive(REPLY_TIMEOUT_S):
            if message.name == "Descriptor":
                pages[message.data[0]] = message.data[1:]
                if len(pages) == PAGES:
                    break
            else:
                self.events.append(message)
        return pages

    def heartbeat(self) -> None:
        """Tells the robot that its host is alive."""
        state = {"HostState": int(self.trial_id != 0), "TrialId": self.trial_id}
        self.send("HostHeartbeat", {**state, "Session": self.session})

    def upload(self, image: ControllerImage) -> None:
        """Loads and commits a genome; the network in use stays until the robot has all of it.

        Raises:
            AssertionError: what the robot decoded is not what was sent.
            NoAnswer, Refused: see `request`.
        """
        self.request(
            Op.LOAD,
            Coding=CODING_NUMBER[image.coding],
            Neuron=NEURON_NUMBER[image.dynamics.neuron],
            Sensors=image.size.n_sensors,
            Hidden=image.size.n_hidden,
            Motors=image.size.n_motors,
            InitialOutput=image.dynamics.initial_output,
        )
        genome = image.packed_genome
        chunks = [genome[k : k + CHUNK_BYTES].ljust(CHUNK_BYTES, b"\0") for k in range(0, len(genome), CHUNK_BYTES)]
        for index in range(len(chunks)):
            self._send_chunk(index, chunks[index])
        for _ in range(len(chunks) + 1):
            try:
                reply = self.request(Op.COMMIT, GenomeCrc=image.record_crc)
            except Refused as refused:
                if refused.status is not Status.MISSING_CHUNK:
                    raise
                missing = refused.reply["MissingChunk"]
                self._send_chunk(missing, chunks[missing])
                continue
            if reply["Crc"] != image.weights_crc:
                raise AssertionError(
                    f"weights: expected CRC-32 {image.weights_crc:08x}, the robot decoded {reply['Crc']:08x}"
                )
            return
        raise NoAnswer("GENOME: the line loses every chunk")

    def _send_chunk(self, index: int, chunk: bytes) -> None:
        self.send("Genome", {"Chunk": index, **{f"Byte{k}": byte for k, byte in enumerate(chunk)}})

    def store(self, autorun_tick_s: float | None = None, action: StoreAction = StoreAction.AUTORUN) -> int:
        """Keeps the committed genome over power loss; returns the CRC-32 of the stored record."""
        if autorun_tick_s is None:
            action = StoreAction.KEEP
        tick = round((autorun_tick_s or 0.0) * 10_000)
        return self.request(Op.STORE, StoreAction=int(action), AutorunTickPeriod=tick)["StoredCrc"]

    def start(
        self, trial_id: int, max_ticks: int, mode: Mode, tick_s: float = 0.02, telemetry: Telemetry = Telemetry.NONE
    ) -> None:
        """Arms the robot and starts a trial."""
        self.request(Op.ARM, TickPeriod=round(tick_s * 10_000))
        self.trial_id = trial_id
        self.request(Op.START, TrialId=trial_id, MaxTicks=max_ticks, Mode=int(mode), Telemetry=int(telemetry))

    # -- lock-step --------------------------------------------------------------------------------------------------

    def sense_in(self, tick: int, sensors: NDArray[np.integer[Any]]) -> None:
        """The sensors of one tick in HIL mode, one or two messages."""
        for page in range(1 if len(sensors) <= 6 else 2):
            values = {f"Sensor{k}": int(sensors[k]) if k < len(sensors) else 0 for k in range(6 * page, 6 * page + 6)}
            self.send("SenseInPage2" if page else "SenseIn", {**values, "Tick": tick % 16})

    def hil_step(
        self, tick: int, sensors: NDArray[np.integer[Any]], n_neurons: int, n_motors: int
    ) -> tuple[NDArray[np.int16], NDArray[np.int16], int]:
        """One lock-step with telemetry STATES: states u, motor outputs, and the low byte of the state hash.

        Raises:
            NoAnswer: the robot does not answer this tick.
        """
        for attempt in range(STEP_TRIES):
            states = np.full(-(-n_neurons // 3) * 3, -0x8000, np.int16)
            if attempt:
                self.heartbeat()
            self.sense_in(tick, sensors)
            for message in self.receive(STEP_TIMEOUT_S):
                s = message.signals
                if message.name == "NeuronStates" and s["Tick"] == tick % 256:
                    states[s["First"] : s["First"] + 3] = s["U0"], s["U1"], s["U2"]
                elif message.name == "Drive" and s["Tick"] == tick % 256:
                    motors = np.array([s[f"Motor{k}"] for k in range(n_motors)], np.int16)
                    if motors.max() > ONE:
                        raise NoAnswer(f"tick {tick}: expected motors 0..{ONE}, got {motors}")
                    if (states[:n_neurons] == -0x8000).any():
                        raise NoAnswer(f"tick {tick}: the line lost a part of the states")
                    return states[:n_neurons], motors, s["Hash"]
                elif message.name not in ("NeuronStates", "Drive"):
                    self.events.append(message)
        raise NoAnswer(f"tick {tick}: no DRIVE from the robot after {STEP_TRIES} tries")

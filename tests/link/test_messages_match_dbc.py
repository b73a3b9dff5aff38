"""Every message of ``firmware/sceann.dbc``, packed or unpacked by `sceann_hil.link.messages` and by cantools."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cantools
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sceann_hil.link import messages as m
from sceann_hil.link.descriptor import Capability, Descriptor
from sceann_hil.link.numbers import LINK_VERSION
from sceann_hil.link.vocabulary import EventCode, Function, Mode, Op, State, Status, StoreAction, Telemetry
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.network.image import CODING_NUMBER, NEURON_NUMBER, ControllerImage

DBC: Any = cantools.database.load_file(Path(__file__).parents[2] / "firmware" / "sceann.dbc")

u8, u16, u32 = st.integers(0, 255), st.integers(0, 65535), st.integers(0, 2**32 - 1)
sensor, motor = st.integers(0, 1023), st.integers(0, 1024)


def encoded(name: str, signals: dict[str, int], length: int | None = None) -> bytes:
    return bytes(DBC.get_message_by_name(name).encode(signals, scaling=False, strict=False))[:length]


def test_every_function_is_a_message_of_the_dbc_with_this_identifier() -> None:
    ours = {m.identifier(function, 1) for function in Function}
    assert ours == {message.frame_id for message in DBC.messages}


@pytest.mark.parametrize(
    ("message", "signal", "ours"),
    [
        ("Command", "Op", Op),
        ("Reply", "Op", Op),
        ("Reply", "Status", Status),
        ("Reply", "State", State),
        ("Heartbeat", "State", State),
        ("Event", "State", State),
        ("Event", "Code", EventCode),
        ("Command", "Mode", Mode),
        ("End", "Reason", m.LinkEnd),
        ("Reply", "LastReason", m.LinkEnd),
    ],
)
def test_the_numbers_of_an_enumeration_are_the_dbcs(message: str, signal: str, ours: Any) -> None:
    choices = DBC.get_message_by_name(message).get_signal_by_name(signal).choices
    assert {int(member) for member in ours} == set(choices)


@pytest.mark.parametrize(("name", "page"), [("SenseIn", 0), ("Sense", 0), ("SenseInPage2", 1), ("SensePage2", 1)])
@given(values=st.lists(sensor, min_size=6, max_size=6), tick=u16)
def test_sensor_pages(name: str, page: int, values: list[int], tick: int) -> None:
    signals = {f"Sensor{6 * page + k}": value for k, value in enumerate(values)}
    data = encoded(name, {**signals, "Tick": tick % 16})
    assert m.pack_sensors(values, tick) == data
    assert m.unpack_sensors(data) == (tick % 16, tuple(values))


@given(values=st.lists(sensor, min_size=1, max_size=5), tick=u16)
def test_absent_sensors_are_zero(values: list[int], tick: int) -> None:
    signals = {f"Sensor{k}": value for k, value in enumerate([*values, *[0] * (6 - len(values))])}
    assert m.pack_sensors(values, tick) == encoded("SenseIn", {**signals, "Tick": tick % 16})


@pytest.mark.parametrize(("name", "low_byte"), [("Drive", "Hash"), ("DriveIn", "SessionLow")])
@given(motors=st.lists(motor, min_size=1, max_size=3), tick=u16, state_hash=u16)
def test_drives(name: str, low_byte: str, motors: list[int], tick: int, state_hash: int) -> None:
    signals = {f"Motor{k}": motors[k] if k < len(motors) else 0 for k in range(3)}
    data = encoded(name, {**signals, "Tick": tick % 256, low_byte: state_hash % 256})
    assert m.pack_drive(tick, state_hash, motors) == data
    assert m.unpack_drive(data, len(motors)) == (tick % 256, state_hash % 256, tuple(motors))


@given(first=st.integers(0, 21), tick=u8, states=st.tuples(*[st.integers(-8192, 8192)] * 3))
def test_neuron_states(first: int, tick: int, states: tuple[int, int, int]) -> None:
    data = encoded("NeuronStates", {"First": first, "Tick": tick, "U0": states[0], "U1": states[1], "U2": states[2]})
    assert m.unpack_states(data) == (first, tick, states)


@given(code=u8, state=u8, tick=u16, argument=u16, trial_id=u16)
def test_events(code: int, state: int, tick: int, argument: int, trial_id: int) -> None:
    data = encoded("Event", {"Code": code, "State": state, "Tick": tick, "Argument": argument, "TrialId": trial_id})
    assert m.Event.unpack(data) == m.Event(code, state, tick, argument, trial_id)


@given(trial_id=u16, reason=st.sampled_from(m.LinkEnd), ticks=u16, state_hash=u16)
def test_ends(trial_id: int, reason: m.LinkEnd, ticks: int, state_hash: int) -> None:
    data = encoded("End", {"TrialId": trial_id, "Reason": reason, "Ticks": ticks, "StateHash": state_hash})
    assert m.End.unpack(data) == m.End(trial_id, reason, ticks, state_hash)


@given(state=u8, uptime=u32, battery=u16, errors=u8)
def test_heartbeats(state: int, uptime: int, battery: int, errors: int) -> None:
    data = encoded("Heartbeat", {"State": state, "Uptime": uptime, "Battery": battery, "ReceiveErrors": errors})
    assert m.Heartbeat.unpack(data) == m.Heartbeat(state, uptime, battery, errors)


@given(trial_id=u16, session=st.integers(1, 65535))
def test_host_heartbeats(trial_id: int, session: int) -> None:
    signals = {"HostState": int(trial_id != 0), "TrialId": trial_id, "Session": session}
    assert m.host_heartbeat(trial_id, session) == encoded("HostHeartbeat", signals)


@given(index=st.integers(0, 18), chunk=st.binary(min_size=1, max_size=7))
def test_genome_chunks(index: int, chunk: bytes) -> None:
    signals = {f"Byte{k}": byte for k, byte in enumerate(chunk.ljust(7, b"\0"))}
    assert m.pack_chunk(index, chunk) == encoded("Genome", {"Chunk": index, **signals})


SESSION = 0xBEEF


def command(op: Op, **arguments: int) -> bytes:
    return encoded("Command", {"Op": op, "Sequence": 11, "Session": SESSION, **arguments})


def ours(op: Op, arguments: bytes = b"") -> bytes:
    return m.pack_command(op, 11, SESSION, arguments)


@given(arithmetic_id=u32)
def test_hello(arithmetic_id: int) -> None:
    expected = command(Op.HELLO, LinkVersion=LINK_VERSION, ArithmeticId=arithmetic_id)
    assert ours(Op.HELLO, m.hello_arguments(arithmetic_id)) == expected


@pytest.mark.parametrize("coding", Coding)
@pytest.mark.parametrize("neuron", Neuron)
@given(counts=st.tuples(st.integers(1, 12), st.integers(1, 8), st.integers(1, 3)), initial_output=motor)
def test_load(coding: Coding, neuron: Neuron, counts: tuple[int, int, int], initial_output: int) -> None:
    size = NetworkSize(*counts)
    bits = np.zeros(coding.genome_length(size), np.uint8)
    image = ControllerImage(bits, coding, size, Dynamics(neuron=neuron, initial_output=initial_output))
    signals = {"Coding": CODING_NUMBER[coding], "Neuron": NEURON_NUMBER[neuron], "InitialOutput": initial_output}
    body = dict(zip(("Sensors", "Hidden", "Motors"), counts, strict=True))
    assert ours(Op.LOAD, m.load_arguments(image)) == command(Op.LOAD, **signals, **body)


@given(crc=u32)
def test_commit(crc: int) -> None:
    assert ours(Op.COMMIT, m.commit_arguments(crc)) == command(Op.COMMIT, GenomeCrc=crc)


@given(period=st.integers(1, 65535))
def test_arm(period: int) -> None:
    assert ours(Op.ARM, m.arm_arguments(period * 1e-4)) == command(Op.ARM, TickPeriod=period)


@given(
    trial_id=st.integers(1, 65535),
    max_ticks=st.integers(1, 65535),
    mode=st.sampled_from(Mode),
    telemetry=st.integers(0, 7),
)
def test_start(trial_id: int, max_ticks: int, mode: Mode, telemetry: int) -> None:
    arguments = m.start_arguments(trial_id, max_ticks, mode, Telemetry(telemetry))
    expected = command(Op.START, TrialId=trial_id, MaxTicks=max_ticks, Mode=mode, Telemetry=telemetry)
    assert ours(Op.START, arguments) == expected


@given(action=st.sampled_from(StoreAction), period=st.integers(0, 32767))
def test_store(action: StoreAction, period: int) -> None:
    expected = command(Op.STORE, StoreAction=action, AutorunTickPeriod=period)
    assert ours(Op.STORE, m.store_arguments(action, period * 1e-4)) == expected


@given(node=st.integers(1, 127))
def test_node(node: int) -> None:
    assert ours(Op.NODE, m.node_arguments(node)) == command(Op.NODE, NewNode=node)


@pytest.mark.parametrize("op", [Op.STOP, Op.CLEAR, Op.LAST, Op.STORED])
def test_commands_without_arguments(op: Op) -> None:
    assert ours(op) == command(op)


@given(status=st.sampled_from(Status), crc=u32, missing=u8)
def test_replies(status: Status, crc: int, missing: int) -> None:
    signals = {"Op": Op.COMMIT, "Sequence": 7, "Status": status, "Crc": crc, "MissingChunk": missing}
    reply = m.Reply.unpack(encoded("Reply", signals))
    assert (reply.op, reply.sequence, reply.status) == (Op.COMMIT, 7, status)
    assert (reply.u32(), reply.missing_chunk) == (crc, missing)


def test_descriptor_pages() -> None:
    pages: list[dict[str, int]] = [
        {"LinkVersion": 1, "Sensors": 7, "Motors": 2, "ArithmeticId": 0x2557477E},
        {"FirmwareMajor": 3, "FirmwareMinor": 2, "FirmwarePatch": 1, "Capabilities": 0x4F, "Node": 5, "Pages": 7},
        {"MaxSensors": 12, "MaxMotors": 3, "MaxSources": 23, "TickPeriodMin": 5, "TickPeriodMax": 1000},
        {"UniqueIdLow": 0x89ABCDEF, "UniqueIdHigh": 0x123456},
        {"Name0": int.from_bytes(b"abcd", "little"), "Name4": int.from_bytes(b"efg", "little")},
        {"Name7": int.from_bytes(b"hijk", "little"), "Name11": int.from_bytes(b"lm", "little")},
        {"Name14": 0, "Name18": 0},
    ]
    raw = {k: encoded("Descriptor", {"Page": k, **signals})[1:] for k, signals in enumerate(pages)}
    descriptor = Descriptor.from_pages(raw)
    assert descriptor.name == "abcdefghijklm"
    assert descriptor.unique_id == 0x12345689ABCDEF
    assert descriptor.firmware == (3, 2, 1)
    assert (descriptor.n_sensors, descriptor.n_motors, descriptor.arithmetic_id) == (7, 2, 0x2557477E)
    assert (descriptor.max_sensors, descriptor.max_motors, descriptor.max_sources) == (12, 3, 23)
    assert (descriptor.tick_min_s, descriptor.tick_max_s) == pytest.approx((0.0005, 0.1))
    assert Capability.BUMPER in descriptor.capabilities
    assert Capability.WATCHDOG not in descriptor.capabilities

"""The second reading of the specification: our numbers are those of the DBC, our frames those of the C code."""

from __future__ import annotations

from enum import IntEnum
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.firmware.build import Board
from sceann_hil.firmware.emulated.qemu import QemuBoard
from sceann_hil.link.framing import decode_frame, encode_frame
from sceann_hil.link.vocabulary import Mode, Op, Status
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.network.image import ControllerImage
from sceann_hil.robot import EndReason
from tests.firmware.rig import an_image
from tests.link.oracle import RobotClient, database


@pytest.mark.parametrize(
    ("message", "signal", "numbers"),
    [("Command", "Op", Op), ("Reply", "Op", Op), ("Reply", "Status", Status), ("Command", "Mode", Mode)],
)
def test_enums_are_those_of_the_dbc(message: str, signal: str, numbers: type[IntEnum]) -> None:
    choices = database().get_message_by_name(message).get_signal_by_name(signal).choices
    assert choices is not None
    ours = {member.value: member.name.title().replace("_", "") for member in numbers}
    assert {number: str(name) for number, name in choices.items()} == ours


def test_end_reasons_of_the_link_are_those_of_the_framework() -> None:
    choices = database().get_message_by_name("End").get_signal_by_name("Reason").choices
    assert choices is not None
    link = {str(name): number for number, name in choices.items()}
    assert link["MaxTicks"] == EndReason.TIME_UP
    assert link["LinkLost"] == EndReason.LINK_LOST
    assert link["BatteryLow"] == EndReason.BATTERY
    assert link["Fault"] == EndReason.FAULT
    assert link["Estop"] == EndReason.EMERGENCY_STOP
    assert link["Overrun"] == EndReason.OVERRUN


def test_every_frame_survives_and_no_flipped_bit_does() -> None:
    generator = np.random.default_rng(1)
    for length in range(9):
        data = generator.integers(0, 3, length).astype(np.uint8).tobytes()
        frame = encode_frame(0x181, data)
        assert len(frame) <= 14
        assert decode_frame(frame[:-1]) == (0x181, data)
        for bit in range(8 * (len(frame) - 1)):
            broken = bytearray(frame[:-1])
            broken[bit // 8] ^= 1 << bit % 8
            assert decode_frame(bytes(broken)) is None


def test_an_image_refuses_a_genome_of_another_length() -> None:
    with pytest.raises(ValueError, match="expected 24 bits"):
        ControllerImage(np.zeros(23, np.uint8), Coding.SCEANN3, NetworkSize(2, 3, 1))


def test_a_record_holds_everything_that_makes_a_controller() -> None:
    size, dynamics = NetworkSize(2, 3, 1), Dynamics(Neuron.MEMORYLESS, 7)
    image = ControllerImage(np.ones(24, np.uint8), Coding.SCEANN3, size, dynamics)
    assert image.record == bytes([3, 1, 2, 3, 1, 24, 0, 7, 0, 0xFF, 0xFF, 0xFF])


def test_an_emulated_cortex_m_keeps_its_genome_in_the_eeprom(tmp_path: Path) -> None:
    image, eeprom = an_image(), tmp_path / "eeprom"
    with QemuBoard(Board.LM3S6965, eeprom=eeprom) as board:
        client = RobotClient(board.line)
        client.hello()
        client.upload(image)
        assert client.store() == image.record_crc
    with QemuBoard(Board.LM3S6965, eeprom=eeprom) as board:
        client = RobotClient(board.line)
        client.hello()
        assert client.request(Op.STORED)["StoredGenomeCrc"] == image.record_crc

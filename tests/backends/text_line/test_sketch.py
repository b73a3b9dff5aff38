"""The example's sketch on an emulated Uno is the robot that its configuration describes."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.config import load_config
from sceann_hil.firmware.emulated.simavr import HZ, AvrChip
from sceann_hil.firmware.emulated.terminal import ChipTerminal
from sceann_hil.network.coding import NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import EndReason, Trials
from tests.firmware.test_arduino import arduino_build

EXAMPLES = Path(__file__).parents[3] / "examples"
LIGHTS = (300, 512, 700)
SIZE = NetworkSize(3, 1, 2)
TCCR0A = 0x44
"""Its upper four bits connect the timer to pins 6 and 5; analogWrite disconnects them at 0 and at 255."""


@pytest.fixture(scope="module")
def elf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return arduino_build(
        EXAMPLES / "light_seeker_sketch" / "light_seeker_sketch.ino", tmp_path_factory.mktemp("sketch")
    )


def lit(elf: Path) -> AvrChip:
    chip = AvrChip(elf)
    for channel, value in enumerate(LIGHTS):
        chip.set_analogue(channel, value)
    return chip


@pytest.fixture
def chip(elf: Path) -> Iterator[AvrChip]:
    with lit(elf) as chip:
        chip.run(HZ // 10)
        yield chip


def said(chip: AvrChip, line: bytes) -> bytes:
    chip.write(line)
    answer = b""
    for _ in range(100):
        answer += chip.read(0.01)
        if answer.endswith(b"\n"):
            break
    return answer


def test_a_trial_on_the_emulated_uno(elf: Path) -> None:
    config = load_config(EXAMPLES / "light_seeker.yaml").robot
    with ChipTerminal(lambda: lit(elf)) as terminal:
        port = config.model_copy(update={"port": str(terminal.port), "answer_s": 1.0, "tick_s": 0.2})
        with port.build() as robot:
            weights = np.ones((1, SIZE.n_neurons, SIZE.n_sources), np.int8)
            one, start = np.zeros(1, np.int32), np.zeros((1, 3))
            keys = np.zeros(1, np.uint64)
            results = robot.run(Trials(SIZE, Dynamics(), weights, one, start, keys, 5, np.array([1])))
        assert EndReason(results.end_reasons[0]) is EndReason.TIME_UP
        assert results.traces is not None
        assert results.traces[0].sensors.tolist() == [list(LIGHTS)] * 5


def test_it_drives_and_stops_by_itself_when_nobody_speaks(chip: AvrChip) -> None:
    assert said(chip, b"m 120 80\n") == b"ok\n"
    assert chip.peek(TCCR0A, 1)[0] & 0xA0 == 0xA0
    chip.run(HZ // 4)
    assert chip.peek(TCCR0A, 1)[0] & 0xA0 == 0xA0
    chip.run(HZ // 2)
    assert chip.peek(TCCR0A, 1)[0] & 0xA0 == 0


@pytest.mark.parametrize("line", [b"\n", b"m\n", b"m 12\n", b"m 12 x\n", b"m 12 34 56\n", b"stop\n", 60 * b"m" + b"\n"])
def test_what_it_does_not_understand_does_not_drive_it(chip: AvrChip, line: bytes) -> None:
    assert said(chip, line) == b"what?\n"
    assert chip.peek(TCCR0A, 1)[0] & 0xA0 == 0

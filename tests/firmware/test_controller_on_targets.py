"""The run-time controller on every target against the reference: every state, every step, and the whole sigmoid."""

from __future__ import annotations

import ctypes as ct
import subprocess
import zlib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.firmware.build import (
    AVR,
    CORTEX_M3,
    CORTEX_M4,
    FIRMWARE,
    HOST_CLANG,
    HOST_GCC,
    Board,
    Toolchain,
    compile_c,
)
from sceann_hil.firmware.emulated.qemu import qemu_command
from sceann_hil.firmware.emulated.simavr import AvrChip, symbols
from sceann_hil.network.controller import sigmoid, state_hash
from tests.firmware.networks import MAX_SENSORS, Case, cases

HERE = Path(__file__).parent / "c"
CORE = [FIRMWARE / "src" / name for name in ("sceann_controller.c", "sceann_crc.c", "sceann_wire.c")]
INCLUDE = [FIRMWARE / "src", HERE]
N_NETWORKS, N_STEPS = 200, 10_000
ALL_STATES = np.arange(-8192, 8193, dtype=np.int16)
SIGMOID_CRC = 0x83FC97A0


@cache
def all_cases() -> list[Case]:
    return cases(seed=20240601, n_networks=N_NETWORKS, n_steps=N_STEPS)


def assert_equal_states(case: Case, states: np.ndarray, motors: np.ndarray) -> None:
    differs = np.flatnonzero((states != case.states).any(1) | (motors != case.motors).any(1))
    assert len(differs) == 0, f"{case.image.size} {case.image.coding}: first difference in step {differs[0]}"


def test_the_batch_reference_is_the_reference_controller() -> None:
    for case in all_cases()[::20]:
        controller = case.image.controller()
        for step in range(300):
            motors = controller.step(case.sensors[step])
            assert np.array_equal(controller.u, case.states[step])
            assert np.array_equal(motors, case.motors[step])


def test_networks_cover_codings_readings_and_sizes() -> None:
    images = [case.image for case in all_cases()]
    assert {image.coding.value for image in images} == {"sceann1", "sceann2", "sceann3"}
    assert len({image.dynamics.neuron for image in images}) == 2
    assert max(image.size.n_sources for image in images) == 23
    assert min(image.size.n_hidden for image in images) == 0


@pytest.mark.parametrize("toolchain", [HOST_GCC, HOST_CLANG], ids=["gcc", "clang"])
class TestHost:
    @staticmethod
    def library(toolchain: Toolchain) -> ct.CDLL:
        sources = [HERE / "host.c", HERE / "steps.c", *CORE]
        return ct.CDLL(str(compile_c(toolchain, sources, include=INCLUDE, flags=["-shared", "-fPIC"], suffix=".so")))

    def test_every_state_hash_and_weight(self, toolchain: Toolchain) -> None:
        library = self.library(toolchain)
        for case in all_cases():
            states, motors = np.empty_like(case.states), np.empty_like(case.motors)
            final_hash, weights_crc = ct.c_uint16(), ct.c_uint32()
            result = library.host_run(
                case.image.record,
                case.sensors.ctypes.data_as(ct.c_void_p),
                ct.c_uint32(N_STEPS),
                states.ctypes.data_as(ct.c_void_p),
                motors.ctypes.data_as(ct.c_void_p),
                ct.byref(final_hash),
                ct.byref(weights_crc),
            )
            assert result == 0
            assert_equal_states(case, states, motors)
            assert final_hash.value == state_hash(case.states)
            assert weights_crc.value == case.image.weights_crc

    def test_sigmoid_of_every_state(self, toolchain: Toolchain) -> None:
        x = np.empty_like(ALL_STATES)
        self.library(toolchain).host_sigmoid(
            ALL_STATES.ctypes.data_as(ct.c_void_p), ct.c_uint32(len(x)), x.ctypes.data_as(ct.c_void_p)
        )
        assert np.array_equal(x, sigmoid(ALL_STATES))
        assert zlib.crc32(x.astype("<u2").tobytes()) == SIGMOID_CRC


class TestAtmega328p:
    LOAD, STEP, SIGMOID = 1, 2, 3

    @pytest.fixture
    def elf(self) -> Path:
        return compile_c(AVR, [HERE / "avr.c", *CORE], include=INCLUDE)

    @pytest.fixture
    def chip(self, elf: Path):
        with AvrChip(elf) as chip:
            chip.run(10_000)  # past the start-up code, which clears the mailbox
            yield chip

    @pytest.mark.parametrize("part", range(4))
    def test_every_state_in_constant_time(self, chip: AvrChip, elf: Path, part: int) -> None:
        mailbox = symbols(elf)["mailbox"]
        inbox, outbox = mailbox + 2, mailbox + 2 + 9 + 127
        for case in all_cases()[50 * part : 50 * part + 50]:
            size = case.image.size
            record = np.frombuffer(case.image.record, np.uint8)[None]
            assert chip.exchange(mailbox, self.LOAD, inbox, record, mailbox + 1, 1)[0, 0] == 0
            sensors = np.zeros((N_STEPS, MAX_SENSORS), "<u2")
            sensors[:, : size.n_sensors] = case.sensors
            chip.mark_at(0x3E)
            n_out = 2 * (size.n_neurons + size.n_motors)
            out = chip.exchange(mailbox, self.STEP, inbox, sensors.view(np.uint8), outbox, n_out).view("<i2")
            assert_equal_states(case, out[:, : size.n_neurons], out[:, size.n_neurons :])
            fastest, slowest = chip.marked_cycles
            assert fastest == slowest, f"{size}: a step takes {fastest} to {slowest} cycles"

    def test_sigmoid_of_every_state(self, chip: AvrChip, elf: Path) -> None:
        mailbox = symbols(elf)["mailbox"]
        rows = ALL_STATES.astype("<i2").view(np.uint8).reshape(-1, 2)
        x = chip.exchange(mailbox, self.SIGMOID, mailbox + 2, rows, mailbox + 2 + 9 + 127, 2).view("<i2").ravel()
        assert np.array_equal(x, sigmoid(ALL_STATES))


@pytest.mark.parametrize(
    ("board", "toolchain"), [(Board.LM3S6965, CORTEX_M3), (Board.STM32F405, CORTEX_M4)], ids=["m3", "m4"]
)
def test_cortex_m_every_state_and_sigmoid(board: Board, toolchain: Toolchain, tmp_path: Path) -> None:
    folder = FIRMWARE / "boards"
    image = compile_c(
        toolchain,
        [HERE / "cortexm.c", HERE / "steps.c", *CORE],
        include=[*INCLUDE, folder / board.value, folder / "cortexm"],
        flags=[f"-T{folder / board.value / 'memory.ld'}", f"-L{folder / 'cortexm'}"],
    )
    with (tmp_path / "questions").open("wb") as questions:
        for case in all_cases():
            questions.write(np.array([1, N_STEPS], "<u4").tobytes() + case.image.record.ljust(136, b"\0"))
            questions.write(case.sensors.astype("<u2").tobytes())
        questions.write(np.array([2, 0, 0, 0], "<u4").tobytes())
    command = qemu_command(board, image, ["-semihosting-config", "enable=on,target=native"])
    subprocess.run(command, cwd=tmp_path, check=True, timeout=200, stdin=subprocess.DEVNULL)
    answers = np.fromfile(tmp_path / "answers", "<i2")
    at = 0
    for case in all_cases():
        n_neurons, n_motors = case.states.shape[1], case.motors.shape[1]
        for first in range(0, N_STEPS, 256):
            rows = min(256, N_STEPS - first)
            states = answers[at : at + rows * n_neurons].reshape(rows, n_neurons)
            at += rows * n_neurons
            motors = answers[at : at + rows * n_motors].reshape(rows, n_motors)
            at += rows * n_motors
            assert np.array_equal(states, case.states[first : first + rows]), f"{case.image.size}, step {first}+"
            assert np.array_equal(motors, case.motors[first : first + rows])
    assert np.array_equal(answers[at:], sigmoid(ALL_STATES))

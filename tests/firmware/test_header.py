"""The exported header: the reference's states, clean under every compiler, within its budgets, deterministic."""

from __future__ import annotations

import ctypes as ct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.errors import FirmwareBuildFailed
from sceann_hil.firmware.build import AVR, HOST_CLANG, HOST_GCC, WARNINGS, compile_c, find_tool
from sceann_hil.firmware.emulated.measure import (
    avr_cost,
    cortex_m0_cost,
    cortex_m3_cost,
    cortex_m3_self_test,
    riscv_cost,
    riscv_self_test,
    with_header,
)
from sceann_hil.firmware.emulated.simavr import AvrChip, symbols
from sceann_hil.firmware.header import Optimize, c_header
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.network.image import ControllerImage
from tests.firmware.networks import Case, cases, random_sensors

HERE = Path(__file__).parent / "c"
SIZE = NetworkSize(7, 2, 2)


def image_of(coding: Coding, seed: int = 1, dynamics: Dynamics = Dynamics()) -> ControllerImage:  # noqa: B008
    genome = np.random.default_rng(seed).integers(0, 2, coding.genome_length(SIZE)).astype(np.uint8)
    return ControllerImage(genome, coding, SIZE, dynamics, fitness=0.75, provenance="sceann export runs/a --genome 17")


@pytest.mark.parametrize("optimize", Optimize)
@pytest.mark.parametrize("toolchain", [HOST_GCC, HOST_CLANG], ids=["gcc", "clang"])
def test_states_and_motors_equal_the_reference_on_the_host(optimize: Optimize, toolchain, tmp_path: Path) -> None:
    for case in cases(seed=5, n_networks=24, n_steps=2000):
        (tmp_path / "net.h").write_text(c_header(case.image, "net", optimize))
        source = [HERE / "header_host.c"]
        flags = ["-shared", "-fPIC"]
        library = ct.CDLL(str(compile_c(toolchain, source, include=[tmp_path], flags=flags, suffix=".so")))
        states, motors = np.empty_like(case.states), np.empty_like(case.motors)
        sensors = case.sensors.ctypes.data_as(ct.c_void_p)
        out = (states.ctypes.data_as(ct.c_void_p), motors.ctypes.data_as(ct.c_void_p))
        library.header_run(sensors, ct.c_uint32(len(states)), *out)
        assert np.array_equal(states, case.states), case.image.size
        assert np.array_equal(motors, case.motors), case.image.size


def avr_states(case: Case, optimize: Optimize, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    elf = with_header(AVR, "header_avr.c", c_header(case.image, "net", optimize), folder, ("-DCOPY_STATES",))
    mailbox, size = symbols(elf)["mailbox"], case.image.size
    rows = np.zeros((len(case.sensors), 12), "<u2")
    rows[:, : size.n_sensors] = case.sensors
    with AvrChip(elf) as chip:
        chip.run(10_000)
        out = chip.exchange(mailbox, 1, mailbox + 2, rows.view(np.uint8), mailbox + 26, 50).view("<i2")
    return out[:, 3 : 3 + size.n_neurons], out[:, : size.n_motors]


@pytest.mark.parametrize("optimize", Optimize)
def test_states_and_motors_equal_the_reference_on_an_atmega328p(optimize: Optimize, tmp_path: Path) -> None:
    for case in cases(seed=6, n_networks=12, n_steps=2000):
        states, motors = avr_states(case, optimize, tmp_path)
        assert np.array_equal(states, case.states), case.image.size
        assert np.array_equal(motors, case.motors), case.image.size


@pytest.mark.parametrize("optimize", Optimize)
@pytest.mark.parametrize("neuron", Neuron)
def test_self_test_passes_on_a_cortex_m3(optimize: Optimize, neuron: Neuron) -> None:
    assert cortex_m3_self_test(image_of(Coding.SCEANN2, 2, Dynamics(neuron)), optimize) == 0


@pytest.mark.parametrize("optimize", Optimize)
def test_self_test_passes_on_an_atmega328p(optimize: Optimize, tmp_path: Path) -> None:
    elf = with_header(
        AVR, "header_avr.c", c_header(image_of(Coding.SCEANN1), "net", optimize), tmp_path, ("-DNET_SELF_TEST",)
    )
    mailbox = symbols(elf)["mailbox"]
    with AvrChip(elf) as chip:
        chip.run(10_000)
        result = chip.exchange(mailbox, 1, mailbox + 2, np.zeros((1, 24), np.uint8), mailbox + 1, 1)
    assert result[0, 0] == 0


@pytest.mark.parametrize("optimize", Optimize)
@pytest.mark.parametrize("neuron", Neuron)
def test_self_test_passes_on_a_risc_v(optimize: Optimize, neuron: Neuron) -> None:
    assert riscv_self_test(image_of(Coding.SCEANN2, 2, Dynamics(neuron)), optimize) == 0


def test_self_test_finds_a_wrong_state(tmp_path: Path) -> None:
    text = c_header(image_of(Coding.SCEANN3), "net")
    broken = text.replace("u = sum & keep", "u = (sum & keep) ^ 1u")
    assert broken != text
    for header, expected in ((text, 0), (broken, 1)):
        (tmp_path / "net.h").write_text(header)
        program = compile_c(HOST_GCC, [HERE / "selftest.c"], include=[tmp_path], flags=["-DNET_SELF_TEST"])
        assert subprocess.run([program], check=False).returncode == expected


COMPILERS = {
    "gcc c": ("gcc", "gcc", "-std=c99", "c"),
    "gcc c++": ("g++", "g++", "-std=c++11", "c++"),
    "clang c": ("clang", "clang", "-std=c99", "c"),
    "clang c++": ("clang", "clang", "-std=c++11", "c++"),
    "avr c": ("avr-gcc", "gcc-avr", "-std=c99", "c"),
    "avr c++": ("avr-g++", "gcc-avr", "-std=c++11", "c++"),
    "arm c": ("arm-none-eabi-gcc", "gcc-arm-none-eabi", "-std=c99", "c"),
    "arm c++": ("arm-none-eabi-g++", "gcc-arm-none-eabi", "-std=c++11", "c++"),
    "riscv c": ("riscv64-unknown-elf-gcc", "gcc-riscv64-unknown-elf", "-std=c99", "c"),
}
CHIP = {
    "avr": ["-mmcu=atmega328p"],
    "arm": ["-mcpu=cortex-m3", "-mthumb"],
    "riscv64": ["-march=rv32imc", "-mabi=ilp32", "-ffreestanding"],
}


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("optimize", Optimize)
def test_compiles_without_a_warning(compiler: str, optimize: Optimize, tmp_path: Path) -> None:
    program, package, standard, language = COMPILERS[compiler]
    networks = [
        image_of(Coding.SCEANN2, 1, Dynamics(Neuron.MEMORYLESS, 0)),
        image_of(Coding.SCEANN3),
        ControllerImage(np.zeros(48, np.uint8), Coding.SCEANN1, SIZE),
        ControllerImage(np.ones(22 * 23, np.uint8), Coding.SCEANN3, NetworkSize(1, 19, 3)),
    ]
    for image in networks:
        (tmp_path / "net.h").write_text(c_header(image, "net", optimize))
        for extra in ([], ["-DNET_SELF_TEST"]):
            used = HERE / "selftest.c" if extra else tmp_path / "net_only.c"
            (tmp_path / "net_only.c").write_text(
                '#include "net.h"\nvoid f(net_t *n);\nvoid f(net_t *n) { net_reset(n); }\n'
            )
            command = [find_tool(program, package), standard, "-O2", *WARNINGS, *CHIP.get(program.split("-")[0], [])]
            command += [*extra, f"-I{tmp_path}", "-x", language, "-c", str(used), "-o", str(tmp_path / "o")]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            assert done.stderr == ""


@pytest.mark.parametrize("coding", Coding)
@pytest.mark.parametrize("seed", range(3))
def test_costs_stay_within_their_budgets(coding: Coding, seed: int) -> None:
    image = image_of(coding, seed)
    sensors = random_sensors(np.random.default_rng(seed), 3000, SIZE.n_sensors)
    speed = avr_cost(image, Optimize.SPEED, sensors)
    assert speed.step <= 377
    assert speed.flash_bytes <= 780
    assert avr_cost(image, Optimize.SPEED, sensors, as_function=True).step <= 380
    assert avr_cost(image, Optimize.SIZE, sensors).flash_bytes <= 560
    assert cortex_m3_cost(image, Optimize.SPEED).step <= 175
    assert cortex_m0_cost(image, Optimize.SPEED).step <= 230
    assert riscv_cost(image, Optimize.SPEED).step <= 215


def test_the_same_image_gives_the_same_bytes_and_says_how_to_make_it_again() -> None:
    text = c_header(image_of(Coding.SCEANN1), "net")
    assert text == c_header(image_of(Coding.SCEANN1), "net")
    for part in ("sceann export runs/a --genome 17", "sceann1, 48 bits", "0x2557477E", "0.75", "7 sensors, 2 hidden"):
        assert part in text
    assert "/tmp" not in text
    assert all(len(line) <= 120 for line in text.splitlines())


@pytest.mark.parametrize("name", ["", "2wheels", "my robot", "int", "class", "a-b", "a__b", "_x", "ä", "x" * 42, "a\n"])
def test_a_name_that_is_no_identifier_is_refused(name: str) -> None:
    with pytest.raises(FirmwareBuildFailed, match="C identifier"):
        c_header(image_of(Coding.SCEANN1), name)

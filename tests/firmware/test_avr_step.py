"""The exported step in AVR assembler: every way of making sums, every size, however it is compiled."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.firmware.avr_step import avr_step
from sceann_hil.firmware.build import AVR, find_tool
from sceann_hil.firmware.emulated.simavr import AvrChip, symbols
from sceann_hil.firmware.header import c_header
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.network.image import ControllerImage

SIZES = [NetworkSize(*size) for size in ((3, 0, 2), (1, 0, 1), (7, 2, 2), (4, 0, 3), (5, 3, 2), (6, 4, 3), (1, 19, 3))]


def networks() -> list[ControllerImage]:
    """Every size with few and with many connections, in both readings of the neuron."""
    generator = np.random.default_rng(14)
    images = []
    for size in SIZES:
        for neuron in Neuron:
            for density in (0.4, 0.95):
                weights = generator.choice([-1, 1], (size.n_neurons, size.n_sources)).astype(np.int8)
                weights[generator.random(weights.shape) > density] = 0
                genome = Coding.SCEANN2.encode(weights, size)
                images.append(ControllerImage(genome, Coding.SCEANN2, size, Dynamics(neuron)))
    return images


def first_failures(images: list[ControllerImage], folder: Path, compiler: list[str]) -> list[int]:
    """What each header's self-test says on an ATmega328P: 0, or its first step that differs."""
    names = [f"n{k}" for k in range(len(images))]
    for name, image in zip(names, images, strict=True):
        (folder / f"{name}.h").write_text(f"#define {name.upper()}_SELF_TEST\n{c_header(image, name)}")
    calls = "\n".join(f"    results[{k}] = (unsigned char){name}_self_test();" for k, name in enumerate(names))
    includes = "\n".join(f'#include "{name}.h"' for name in names)
    source = folder / "all.c"
    source.write_text(
        f"{includes}\nvolatile unsigned char results[{len(names) + 1}];\nint main(void)\n{{\n{calls}\n"
        f"    results[{len(names)}] = 123;\n    for (;;) {{\n    }}\n}}\n"
    )
    elf = folder / "all.elf"
    flags = [*compiler[1:], "-mmcu=atmega328p", "-Wall", "-Wextra", "-Werror"]
    subprocess.run([find_tool(compiler[0], AVR.package), *flags, str(source), "-o", str(elf)], check=True)
    with AvrChip(elf) as chip:
        while chip.peek(symbols(elf)["results"] + len(names), 1) != b"\x7b":
            chip.run(1_000_000)
            assert chip.cycles < 200_000_000
        return list(chip.peek(symbols(elf)["results"], len(names)))


@pytest.mark.parametrize(
    "compiler",
    [
        ["avr-gcc", "-std=c99", "-Os"],
        ["avr-gcc", "-std=c99", "-O3", "-mcall-prologues"],
        # with a frame pointer, so that Y is taken; and `register` is no keyword of C++17
        ["avr-g++", "-std=c++1z", "-O0", "-x", "c++"],
    ],
    ids=["size", "speed", "frame-pointer"],
)
@pytest.mark.parametrize("part", range(2))
def test_every_network_computes_what_the_simulator_computes(compiler: list[str], part: int, tmp_path: Path) -> None:
    images = networks()[part::2]
    assert first_failures(images, tmp_path, compiler) == [0] * len(images)


def test_a_wrong_instruction_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    images = networks()[:4]
    right = avr_step(images[0])
    monkeypatch.setattr(
        "sceann_hil.firmware.header.avr_step", lambda image: avr_step(image).replace("ldi r30,0x20", "ldi r30,0x21")
    )
    assert avr_step(images[0]) == right
    assert any(first_failures(images, tmp_path, ["avr-gcc", "-std=c99", "-Os"]))


def test_neurons_that_share_many_sources_are_summed_up_together() -> None:
    size = NetworkSize(7, 2, 2)
    weights = np.ones((4, 11), np.int8)
    weights[1, ::2] = -1
    together = avr_step(ControllerImage(Coding.SCEANN2.encode(weights, size), Coding.SCEANN2, size))
    weights[0, ::2] = 0
    weights[1, 1::2] = 0
    apart = avr_step(ControllerImage(Coding.SCEANN2.encode(weights, size), Coding.SCEANN2, size))
    assert apart.count("ldd r18,Y+0") == 1
    assert together.count("ldd r18,Y+0") == 0

"""The folder as an Arduino library, its sketch on the Arduino core, a real avrdude against a real boot loader."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from sceann_hil.errors import FlashFailed
from sceann_hil.firmware.build import AVR, FIRMWARE, Board, find_tool
from sceann_hil.firmware.emulated.measure import section_sizes
from sceann_hil.firmware.emulated.simavr import EXTERNAL_RESET, HZ, AvrChip
from sceann_hil.firmware.emulated.terminal import ChipTerminal
from sceann_hil.firmware.flash import flash, flash_genome, upload_genome
from sceann_hil.firmware.flash_plan import plan_flash, upload_firmware
from sceann_hil.firmware.header import c_header
from sceann_hil.firmware.verify import random_sequences, verify
from sceann_hil.link.framed_bus import LineBus
from sceann_hil.link.messages import LinkEnd
from sceann_hil.link.onboard import run_onboard
from sceann_hil.link.session import RobotLink
from sceann_hil.link.trial import Order
from sceann_hil.link.upload import upload_image
from sceann_hil.link.vocabulary import State
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import state_hash
from sceann_hil.network.image import ControllerImage
from tests.firmware.rig import an_image

ARDUINO = Path("/usr/share/arduino/hardware/arduino/avr")
BOOTLOADER = ARDUINO / "bootloaders" / "optiboot" / "optiboot_atmega328.hex"
BOOT_PC = 0x7E00
SKETCH = FIRMWARE / "examples" / "Walker" / "Walker.ino"


def arduino_build(sketch: Path, folder: Path, board: str = "UNO", variant: str = "standard") -> Path:
    """Compiles a sketch as the Arduino IDE does: core, this library, the sketch."""
    flags = ["-mmcu=atmega328p", "-DF_CPU=16000000L", "-DARDUINO=10819", f"-DARDUINO_AVR_{board}", "-DARDUINO_ARCH_AVR"]
    flags += ["-Os", "-w", "-ffunction-sections", "-fdata-sections", "-DDECIMAL_DIG=__DECIMAL_DIG__"]
    core = ARDUINO / "cores" / "arduino"
    standard = ARDUINO / "variants" / "standard"
    folders = (
        core,
        ARDUINO / "variants" / variant,
        standard,
        ARDUINO / "libraries" / "EEPROM" / "src",
        FIRMWARE / "src",
    )
    includes = [f"-I{path}" for path in (*folders, sketch.parent)]
    gcc, gxx = find_tool("avr-gcc", AVR.package), find_tool("avr-g++", AVR.package)
    objects = []
    sources = [*core.glob("*.c"), *core.glob("*.cpp"), *core.glob("*.S"), *(FIRMWARE / "src").glob("*.c"), sketch]
    for source in sources:
        target = folder / f"{source.parent.name}_{source.name}.o"
        if source.suffix == ".ino":
            command = [gxx, "-std=gnu++11", "-fpermissive", "-fno-exceptions", "-include", "Arduino.h", "-x", "c++"]
        elif source.suffix == ".cpp":
            command = [gxx, "-std=gnu++11", "-fpermissive", "-fno-exceptions", "-fno-threadsafe-statics"]
        else:
            command = [gcc, "-std=gnu11"] if source.suffix == ".c" else [gcc, "-x", "assembler-with-cpp"]
        subprocess.run([*command, *flags, *includes, "-c", str(source), "-o", str(target)], check=True)
        objects.append(str(target))
    elf = folder / "sketch.elf"
    subprocess.run([gcc, *flags, "-Wl,--gc-sections", *objects, "-lm", "-o", str(elf)], check=True)
    return elf


def walker() -> ControllerImage:
    """The network of the example's header, as its banner tells it."""
    text = (SKETCH.parent / "walker.h").read_text()
    banner = dict(re.findall(r"^ \* (made by|genome|fitness) +(.+)$", text, re.MULTILINE))
    size = NetworkSize(5, 2, 2)
    bits = np.unpackbits(np.frombuffer(bytes.fromhex(banner["genome"]), np.uint8))[: Coding.SCEANN3.genome_length(size)]
    fitness = float(banner["fitness"])
    return ControllerImage(bits, Coding.SCEANN3, size, fitness=fitness, provenance=banner["made by"])


def test_the_examples_header_is_what_export_writes_today() -> None:
    assert (SKETCH.parent / "walker.h").read_text() == c_header(walker(), "walker")


SENSORS = [12, 300, 511, 512, 1023]
START, STOP, BUMPER = ("B", 0), ("D", 3), ("D", 2)
DUTIES = (0x47, 0x48)
"""OCR0A and OCR0B: how much of the time D6 (left wheel) and D5 (right wheel) are high."""
TIMER_OUTPUTS = 0x44
"""TCCR0A: its upper half says which of them the timer drives."""
PORT_D = 0x2B


class Walker:
    """The sketch on a simulated Uno, and a person's fingers."""

    def __init__(self, chip: AvrChip) -> None:
        self.chip = chip
        self.text = ""
        for switch in (START, STOP, BUMPER):
            chip.set_pin(*switch, True)
        for channel, value in enumerate(SENSORS):
            chip.set_analogue(channel, value)

    def until(self, words: str, patience_s: float = 5.0) -> None:
        began = self.chip.cycles
        while words not in self.text:
            self.text += self.chip.read(0.01).decode()
            assert self.chip.cycles - began < patience_s * HZ, self.text

    def press(self, switch: tuple[str, int], held_s: float = 0.1) -> None:
        self.chip.set_pin(*switch, False)
        self.wait(held_s)
        self.chip.set_pin(*switch, True)

    def wait(self, duration_s: float) -> None:
        self.chip.run(int(duration_s * HZ))
        self.text += self.chip.read(0.0).decode()

    @property
    def driven(self) -> tuple[bool, bool]:
        """Whether the left and the right wheel get any current."""
        outputs = self.chip.peek(TIMER_OUTPUTS, 1)[0]
        duties = [self.chip.peek(at, 1)[0] for at in DUTIES]
        pins = self.chip.peek(PORT_D, 1)[0]
        by_timer = [bool(outputs & 0x80) and duties[0] > 0, bool(outputs & 0x20) and duties[1] > 0]
        return by_timer[0] or bool(pins & 0x40), by_timer[1] or bool(pins & 0x20)


@pytest.fixture(scope="module")
def walker_elf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return arduino_build(SKETCH, tmp_path_factory.mktemp("walker"))


@pytest.fixture
def sketch(walker_elf: Path) -> Iterator[Walker]:
    with AvrChip(walker_elf) as chip:
        sketch = Walker(chip)
        sketch.until("to try the motors.")
        yield sketch


class TestTheExampleSketch:
    """It waits for its button, computes what the simulator computes, and ends by itself."""

    def test_nothing_moves_before_the_button_is_pressed(self, sketch: Walker) -> None:
        sketch.wait(1.0)
        assert sketch.driven == (False, False)
        assert sketch.text.splitlines()[0] == "self-test passed"

    def test_it_computes_what_the_simulator_computes_until_its_time_is_up(self, sketch: Walker) -> None:
        sketch.text = ""
        sketch.press(START)
        sketch.wait(0.3)
        assert any(sketch.driven)
        sketch.until("stopped: time is up", 16.0)
        assert sketch.driven == (False, False)
        controller = walker().controller()
        *steps, _ = sketch.text.strip().splitlines()
        assert len(steps) == 75
        for line in steps:
            assert [int(word) for word in line.split()] == controller.step(np.array(SENSORS)).tolist()

    @pytest.mark.parametrize(
        ("switch", "why"),
        [(STOP, "stop button"), (BUMPER, "bumper"), (START, "start button")],
        ids=["stop", "bump", "start"],
    )
    def test_every_switch_ends_the_drive(self, switch: tuple[str, int], why: str, sketch: Walker) -> None:
        sketch.press(START)
        sketch.wait(0.5)
        assert any(sketch.driven)
        sketch.press(switch)
        sketch.until(f"stopped: {why}", 1.0)
        sketch.wait(1.0)
        assert sketch.driven == (False, False)

    def test_with_its_stop_button_held_it_does_not_start(self, sketch: Walker) -> None:
        sketch.chip.set_pin(*STOP, False)
        sketch.press(START)
        sketch.until("stopped: stop button", 1.0)
        assert sketch.driven == (False, False)

    def test_it_says_which_motor_is_left(self, sketch: Walker) -> None:
        sketch.chip.set_pin(*START, False)
        sketch.until("the left wheel", 3.0)
        sketch.chip.set_pin(*START, True)
        sketch.wait(0.2)
        assert sketch.driven == (True, False)
        sketch.until("the right wheel", 3.0)
        sketch.wait(0.2)
        assert sketch.driven == (False, True)
        sketch.until("the left one first?", 3.0)
        sketch.wait(0.5)
        assert sketch.driven == (False, False)


ROBOT = FIRMWARE / "examples" / "Robot" / "Robot.ino"


@pytest.fixture(scope="module")
def robot_elf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return arduino_build(ROBOT, tmp_path_factory.mktemp("sketch"))


def switched_on(elf: Path) -> AvrChip:
    """The sketch in a simulated Uno with its switches open."""
    chip = AvrChip(elf)
    chip.eeprom = b"\xff" * 1024
    for port, pin in (("D", 0), ("D", 2), ("D", 3), ("B", 0)):
        chip.set_pin(port, pin, True)
    return chip


class TestTheRobotAsASketch:
    """On the Arduino core, without a register of our own."""

    def test_it_computes_what_the_simulator_computes(self, robot_elf: Path) -> None:
        with switched_on(robot_elf) as chip:
            link = RobotLink(LineBus(chip))
            result = verify(link, an_image(n_sensors=5), random_sequences(np.random.default_rng(4), 20, 20, 5))
            assert result.equal, result.difference
            link.close()

    def test_it_reads_its_inputs_drives_its_motors_and_hashes_as_the_reference(self, robot_elf: Path) -> None:
        sensors, image = [0, 100, 511, 512, 1023], an_image(n_sensors=5)
        with switched_on(robot_elf) as chip:
            for channel, value in enumerate(sensors):
                chip.set_analogue(channel, value)
            link = RobotLink(LineBus(chip))
            descriptor = link.hello(3.0)
            assert (descriptor.n_sensors, descriptor.n_motors) == (5, 2)
            upload_image(link, image)
            follower = run_onboard(link, Order(1, 40, descriptor.tick_min_s, 5, 2), None, None)
            controller, crc = image.controller(), 0xFFFF
            for tick in range(40):
                motors = controller.step(np.array(sensors))
                crc = state_hash(controller.u, crc)
                assert follower.sensors[tick].tolist() == sensors
                assert follower.motors[tick].tolist() == motors.tolist()
            assert follower.end is not None
            assert (follower.end.reason, follower.end.state_hash) == (LinkEnd.MAX_TICKS, crc)
            assert link.statistics.retries == 0
            link.close()

    def test_it_keeps_its_genome_and_stops_at_its_button(self, robot_elf: Path) -> None:
        image = an_image(n_sensors=5)
        with switched_on(robot_elf) as chip:
            link = RobotLink(LineBus(chip))
            assert upload_genome(link, image, "the sketch").stored
            chip.set_pin("D", 3, False)
            link.receive(0.2)
            while link.receive(0.3) and link.state is not State.ESTOP:
                pass
            assert link.state is State.ESTOP
            link.close()

    def test_it_is_a_nano_too(self, tmp_path: Path) -> None:
        with switched_on(arduino_build(ROBOT, tmp_path, "NANO", "eightanaloginputs")) as chip:
            link = RobotLink(LineBus(chip))
            assert link.hello(3.0).name == "nano"
            link.close()

    def test_it_fits_an_uno(self, robot_elf: Path) -> None:
        flash_bytes, ram = section_sizes(robot_elf, AVR.package, "avr-size")
        assert flash_bytes < 31.5 * 1024
        assert ram < 1.5 * 1024


def test_library_descriptions_agree_with_the_firmware() -> None:
    properties = dict(line.split("=", 1) for line in (FIRMWARE / "library.properties").read_text().splitlines())
    platformio = json.loads((FIRMWARE / "library.json").read_text())
    header = (FIRMWARE / "src" / "sceann_numbers.h").read_text()
    version = ".".join(re.findall(r"SCEANN_FIRMWARE_(?:MAJOR|MINOR|PATCH) (\d+)u", header))
    assert properties["version"] == platformio["version"] == version
    assert {"name", "author", "maintainer", "sentence", "paragraph", "category", "url", "architectures"} <= set(
        properties
    )
    assert (FIRMWARE / platformio["build"]["srcDir"] / platformio["headers"]).exists()
    for example in platformio["examples"]:
        assert all((FIRMWARE / example["base"] / name).exists() for name in example["files"])


def test_avrdude_uploads_the_firmware_and_the_robot_answers_with_the_genome(tmp_path: Path) -> None:
    boot = tmp_path / "boot.bin"
    objcopy = find_tool("avr-objcopy", AVR.package)
    subprocess.run([objcopy, "-I", "ihex", "-O", "binary", str(BOOTLOADER), str(boot)], check=True)
    image = an_image(n_sensors=5)
    with ChipTerminal(lambda: AvrChip(boot, reset_pc=BOOT_PC, reset_flags=EXTERNAL_RESET), 0.4) as terminal:
        port = str(terminal.port)
        on_robot = flash(image, plan_flash(image, Board.UNO, port), port)
        assert on_robot.descriptor.name == "uno"
        assert (on_robot.descriptor.n_sensors, on_robot.descriptor.n_motors) == (5, 2)
        assert (on_robot.genome_crc, on_robot.stored) == (image.record_crc, True)
        other = an_image(n_sensors=5, seed=2)
        assert flash_genome(other, port).genome_crc == other.record_crc


def test_an_upload_to_nothing_names_tool_and_port(tmp_path: Path) -> None:
    port = str(tmp_path / "nothing")
    with pytest.raises(FlashFailed, match="avrdude could not write the board") as failed:
        upload_firmware(plan_flash(an_image(n_sensors=5), Board.UNO, port))
    assert port in failed.value.hint


def test_a_sketch_that_is_not_ours_is_told_apart_from_silence(tmp_path: Path) -> None:
    with AvrChip(arduino_build(SKETCH, tmp_path)) as chip, pytest.raises(FlashFailed, match="something else than"):
        upload_genome(RobotLink(LineBus(chip)), an_image(n_sensors=5), "the board")


class Silence:
    """Nobody, in no time."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def write(self, data: bytes) -> None:
        pass

    def read(self, timeout_s: float) -> bytes:
        self.time_s += max(timeout_s, 0.001)
        return b""


def test_silence_is_silence() -> None:
    with pytest.raises(FlashFailed, match="silence"):
        upload_genome(RobotLink(LineBus(Silence())), an_image(), "the board")

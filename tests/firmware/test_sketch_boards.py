"""The robot's sketch with the pin table of every board, on this computer: most boards' cores are not to be had here."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
import pytest

from sceann_hil.firmware.build import FIRMWARE, find_tool
from sceann_hil.firmware.verify import random_sequences, verify
from sceann_hil.link.framed_bus import LineBus
from sceann_hil.link.onboard import run_onboard
from sceann_hil.link.session import RobotLink
from sceann_hil.link.trial import Order
from sceann_hil.link.upload import upload_image
from tests.firmware.rig import an_image

SKETCH = FIRMWARE / "examples" / "Robot" / "Robot.ino"
REPOSITORY = Path(__file__).parents[2]
API = Path(__file__).parent / "c" / "arduino"
INPUT_PULLUP, OUTPUT = 2, 1


@dataclass(frozen=True)
class BoardOfTheSketch:
    """What the core defines for a board.

    Attributes:
        name: as the robot tells it.
        defines: the core's macros.
        n_sensors: analogue inputs that its table uses.
        full_bits: resolution of its converter, as the core begins.
        taken: pins that the board itself needs: serial port, flash memory, and what must not be pulled at the start.
    """

    name: str
    defines: tuple[str, ...]
    n_sensors: int
    full_bits: int = 10
    taken: frozenset[int] = frozenset()


ESP32 = "ARDUINO_ARCH_ESP32"
BOARDS = [
    BoardOfTheSketch("uno r4", ("ARDUINO_ARCH_RENESAS",), 5, taken=frozenset({0, 1})),
    BoardOfTheSketch("nano 33", ("ARDUINO_ARCH_SAMD",), 5, taken=frozenset({0, 1})),
    BoardOfTheSketch("nano 33", ("ARDUINO_ARCH_MBED",), 5, taken=frozenset({0, 1})),
    BoardOfTheSketch("esp32", (ESP32, "CONFIG_IDF_TARGET_ESP32"), 5, 12, frozenset({0, 1, 3, *range(6, 12), 12, 15})),
    BoardOfTheSketch("esp32c3", (ESP32, "CONFIG_IDF_TARGET_ESP32C3"), 4, 12, frozenset({2, *range(11, 18), 20, 21})),
    BoardOfTheSketch(
        "esp32c3",
        (ESP32, "CONFIG_IDF_TARGET_ESP32C3", "ARDUINO_USB_CDC_ON_BOOT=1"),
        4,
        12,
        frozenset({2, *range(11, 20)}),
    ),
    BoardOfTheSketch(
        "esp32s3",
        (ESP32, "CONFIG_IDF_TARGET_ESP32S3"),
        5,
        12,
        frozenset({0, 3, 19, 20, *range(26, 38), 43, 44, 45, 46}),
    ),
    BoardOfTheSketch("pico arduino", ("ARDUINO_ARCH_RP2040",), 3, taken=frozenset({0, 1, 23, 24, 29})),
    BoardOfTheSketch("teensy", ("TEENSYDUINO=159",), 5, taken=frozenset({0, 1})),
    BoardOfTheSketch("microbit 2", ("ARDUINO_BBC_MICROBIT_V2",), 3),
]


class OnThisComputer:
    """A line to the sketch; it tells on start what it did with its pins.

    Attributes:
        baud: of its serial port.
        pins: mode and level of every pin that it set up.
    """

    def __init__(self, program: Path) -> None:
        self._process = subprocess.Popen(
            [program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, bufsize=0
        )
        assert self._process.stderr is not None
        assert self._process.stdout is not None
        self._from = self._process.stdout.fileno()
        speed, *pins = self._process.stderr.readline().split()
        self.baud = int(speed)
        self.pins = {number: (mode, level) for number, mode, level in (map(int, pin.split(b":")) for pin in pins)}

    def now_s(self) -> float:
        return time.monotonic()

    def write(self, data: bytes) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(data)

    def read(self, timeout_s: float) -> bytes:
        return os.read(self._from, 4096) if select.select([self._from], [], [], timeout_s)[0] else b""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        with self._process:
            pass


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The core's object files for this computer."""
    folder = tmp_path_factory.mktemp("core")
    sources = sorted((FIRMWARE / "src").glob("*.c"))
    subprocess.run([find_tool("gcc", "gcc"), "-std=c99", "-O1", "-c", *sources], cwd=folder, check=True)
    return sorted(folder.glob("*.o"))


def build(board: BoardOfTheSketch, core: list[Path], folder: Path) -> Path:
    gxx = find_tool("g++", "g++")
    defines = [f"-D{name}" for name in (*board.defines, f"FULL_BITS={board.full_bits}")]
    flags = ["-std=gnu++17", "-O1", "-Wall", "-Wextra", "-Werror", *defines, f"-I{API}", f"-I{FIRMWARE / 'src'}"]
    sketch = folder / "sketch.o"
    include = ["-include", "Arduino.h", "-x", "c++"]
    subprocess.run([gxx, *flags, f"-I{SKETCH.parent}", *include, "-c", SKETCH, "-o", sketch], check=True)
    program = folder / "robot"
    subprocess.run([gxx, *flags, API / "board.cpp", sketch, *core, "-o", program], check=True)
    return program


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: "-".join(board.defines))
def test_the_sketch_builds_sets_its_pins_up_reads_ten_bits_and_computes_the_same(
    board: BoardOfTheSketch, core: list[Path], tmp_path: Path
) -> None:
    image = an_image(n_sensors=board.n_sensors)
    with OnThisComputer(build(board, core, tmp_path)) as line:
        assert line.baud == 115_200
        outputs = {pin for pin, (mode, _) in line.pins.items() if mode == OUTPUT}
        switches = {pin for pin, (mode, _) in line.pins.items() if mode == INPUT_PULLUP}
        assert len(outputs) in (4, 5)  # speed and direction of two motors, a light
        assert len(switches) == 3
        assert not (outputs | switches) & board.taken
        assert all(level == 0 for pin, (_, level) in line.pins.items() if pin in outputs)
        link = RobotLink(LineBus(line))
        descriptor = link.hello(3.0)
        assert (descriptor.name, descriptor.n_sensors, descriptor.n_motors) == (board.name, board.n_sensors, 2)
        result = verify(link, image, random_sequences(np.random.default_rng(4), 3, 20, board.n_sensors))
        assert result.equal, result.difference
        upload_image(link, image)
        follower = run_onboard(link, Order(1, 3, 0.1, board.n_sensors, 2), None, None)
        assert follower.sensors[0].tolist() == [768] * board.n_sensors
        link.close()


def test_the_drawings_show_the_pins_of_the_tables() -> None:
    done = subprocess.run([sys.executable, "tools/robot_wirings", "--check"], cwd=REPOSITORY, text=True, check=False)
    assert done.returncode == 0
    drawn = {name: (SKETCH.parent / f"{name}.svg").read_text() for name in ("uno", "pico", "esp32")}
    assert all(f">GPIO{pin}<" in drawn["esp32"] for pin in (32, 33, 34, 35, 36, 16, 17, 18, 19, 21, 22, 23))


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: "-".join(board.defines))
def test_no_pin_has_two_uses(board: BoardOfTheSketch, tmp_path: Path) -> None:
    source = tmp_path / "pins.cpp"
    source.write_text(
        '#include "Arduino.h"\n#include "pins.h"\n#include <stdio.h>\nint main() {\n'
        'for (int pin : SENSOR_PINS) printf("%d ", pin);\nfor (int pin : SPEED_PINS) printf("%d ", pin);\n'
        'for (int pin : DIRECTION_PINS) printf("%d ", pin);\n'
        'printf("%d %d %d %d\\n", BUMPER_PIN, STOP_PIN, START_PIN, LIGHT_PIN);\n}\n'
    )
    program = tmp_path / "pins"
    defines = [f"-D{name}" for name in board.defines]
    command = [find_tool("g++", "g++"), *defines, f"-I{API}", f"-I{SKETCH.parent}", source, "-o", program]
    subprocess.run(command, check=True)
    told = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    pins = [int(word) for word in told.split() if int(word) != 255]
    assert len(pins) == len(set(pins))
    assert not set(pins) & board.taken

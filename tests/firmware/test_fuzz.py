"""Frame parser, command handler, genome loader and store under libFuzzer with address and undefined-behaviour checks.

The corpus in ``fuzz/`` is made of real conversations (`seeds`); what a longer run finds belongs there too:

    python -m tests.firmware.test_fuzz 600
"""

from __future__ import annotations

import binascii
import re
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np

from sceann_hil.firmware.build import FIRMWARE, HOST_CLANG, compile_c, find_tool
from sceann_hil.link.framing import encode_frame
from sceann_hil.link.messages import load_arguments
from sceann_hil.link.numbers import LINK_VERSION
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import ARITHMETIC_ID
from sceann_hil.network.image import ControllerImage
from tests.firmware.networks import random_image

HERE = Path(__file__).parent
CORPUS = HERE / "fuzz"
RUNS = 60_000
FLAGS = ["-g", "-O1", "-fsanitize=fuzzer,address,undefined", "-fno-sanitize-recover=all"]


def build() -> Path:
    sources = [HERE / "c" / "fuzz.c", *sorted((FIRMWARE / "src").glob("*.c"))]
    return compile_c(HOST_CLANG, sources, include=[FIRMWARE / "src"], flags=FLAGS)


SESSION = 7


def command(op: int, *arguments: int, layout: str = "") -> bytes:
    body = struct.pack("<" + layout, *arguments).ljust(5, b"\0")
    return encode_frame(0x401, bytes([op]) + body + struct.pack("<H", SESSION))


def conversation(seed: int) -> bytes:
    """HELLO, an upload, a trial in one of the three modes, STORE, LAST: what a good host says."""
    generator = np.random.default_rng(seed)
    image = random_image(generator, 23 if seed % 2 else 7)
    hello = command(1, LINK_VERSION, ARITHMETIC_ID, layout="BI")
    load = encode_frame(0x401, b"\x12" + load_arguments(image) + struct.pack("<H", SESSION))
    genome = image.packed_genome
    chunks = [
        encode_frame(0x381, bytes([k // 7]) + genome[k : k + 7].ljust(7, b"\0")) for k in range(0, len(genome), 7)
    ]
    commit = command(0x23, image.record_crc, layout="I")
    mode = (2, 0, 1)[seed % 3]
    start = command(0x45, 5, 6, mode | 0x70, layout="HHB")
    beat = encode_frame(0x681, struct.pack("<BHH", 1, 5, SESSION))
    ticks = b""
    for tick in range(6):
        sensors = sum(int(generator.integers(1024)) << 10 * k for k in range(6)) | tick << 60
        page = sensors.to_bytes(8, "little")
        ticks += (
            encode_frame(0x201, page)
            + encode_frame(0x601, page)
            + encode_frame(0x301, bytes([tick, SESSION, 0, 2, 0, 1, 0, 0]))
        )
        ticks += bytes([0xF9]) + beat
    store = command(0x48, 1 + seed % 3, 200, layout="BH")
    after = store + command(0x59) + command(0x6A) + command(0x8B, 9, layout="B") + command(0x66) + command(0x77)
    return (
        bytes([2 * (seed % 2)])
        + hello
        + load
        + b"".join(chunks)
        + commit
        + command(0x34, 200, layout="H")
        + start
        + ticks
        + after
    )


def stored(seed: int) -> bytes:
    """A store with a valid genome slot, and a power-on after it."""
    image = random_image(np.random.default_rng(seed), 23)
    fields = struct.pack("<BBH", 0x51, 3, 200)
    crc = zlib.crc32(fields + image.record)
    node = bytes([0x4E, 1, 0xFE])
    return b"\x01\0" + node + fields + struct.pack("<I", crc) + image.record


BODY = NetworkSize(3, 2, 2)
"""What the fuzzed robot has."""
SECOND = bytes([0xFF])
"""Time passes."""


def fitting(seed: int) -> ControllerImage:
    """A network for the robot's own body."""
    genome = np.random.default_rng(seed).integers(0, 2, Coding.SCEANN2.genome_length(BODY)).astype(np.uint8)
    return ControllerImage(genome, Coding.SCEANN2, BODY)


def uploaded(image: ControllerImage) -> bytes:
    genome = image.packed_genome
    chunks = [
        encode_frame(0x381, bytes([k // 7]) + genome[k : k + 7].ljust(7, b"\0")) for k in range(0, len(genome), 7)
    ]
    load = encode_frame(0x401, b"\x12" + load_arguments(image) + struct.pack("<H", SESSION))
    return HELLO + load + b"".join(chunks) + command(0x23, image.record_crc, layout="I")


HELLO = command(1, LINK_VERSION, ARITHMETIC_ID, layout="BI")
BEAT = encode_frame(0x681, struct.pack("<BHH", 1, 5, SESSION))
TICKS = (bytes([0xF9]) * 2 + BEAT) * 12


def onboard(first: int, trouble: bytes) -> bytes:
    """A trial with the robot's own body, and something that happens in it; then it is kept, and forgotten."""
    start = command(0x45, 5, 20, 0x70, layout="HHB")
    after = command(0x66) + command(0x48, 2, 200, layout="BH") + command(0x48, 1, 0, layout="BH")
    after += (
        command(0x4B, 4, layout="B")
        + command(0x4B, 1, layout="B")
        + command(0x48, 0, 0, layout="BH")
        + command(0x59)
        + command(0x6A)
    )
    begun = uploaded(fitting(1)) + command(0x34, 200, layout="H") + start + TICKS[: len(TICKS) // 3]
    return bytes([first]) + begun + trouble + TICKS + after + command(0x67)


def image_of(n_sensors: int, n_motors: int) -> ControllerImage:
    size = NetworkSize(n_sensors, 2, n_motors)
    return ControllerImage(np.ones(Coding.SCEANN2.genome_length(size), np.uint8), Coding.SCEANN2, size)


def uploaded_many() -> bytes:
    """More trials than the ring has places for, in HIL, with answers that were lost and ticks that are none."""
    talk = bytes([0]) + uploaded(fitting(3))
    page = (1 << 60).to_bytes(8, "little")
    for trial in range(1, 35):
        talk += command(0x34, 200, layout="H") + command(0x45, trial, 2, 2, layout="HHB")
        for tick in (0, 0, 7, 1, 1):
            talk += encode_frame(0x201, (tick << 60).to_bytes(8, "little")) + encode_frame(0x601, page)
    return talk


def unplugged(period: int, events: bytes, image: ControllerImage | None = None) -> bytes:
    """A stored champion, and time or a button."""
    image = image or fitting(2)
    fields = struct.pack("<BBH", 0x51, 3, period)
    slot = fields + struct.pack("<I", zlib.crc32(fields + image.record)) + image.record
    newer = bytes([0x51, 4]) + struct.pack("<H", period)
    second = newer + struct.pack("<I", zlib.crc32(newer + image.record)) + image.record
    last = struct.pack("<HHBHH", 9, 77, 0, 20, 0xBEEF)
    last += binascii.crc_hqx(last, 0xFFFF).to_bytes(2, "big")
    content = (b"\0" + bytes([0x4E, 3, 0xFC]) + slot).ljust(148, b"\xff") + second
    content = (content.ljust(292, b"\xff") + last).ljust(1024, b"\xff")
    return b"\x01" + content + b"\0" + events


def refusals() -> bytes:
    """What a host gets that says the wrong things."""
    other = encode_frame(0x401, bytes([1, LINK_VERSION]) + struct.pack("<IH", ARITHMETIC_ID, 9))
    wrong = [command(1, 1, ARITHMETIC_ID, layout="BI"), command(1, LINK_VERSION, 1, layout="BI"), command(2)]
    wrong += [encode_frame(0x401, bytes([1, LINK_VERSION]) + struct.pack("<IH", ARITHMETIC_ID, 0)), HELLO, other]
    wrong += [command(2, 0x01, 0x2D, 3, 512, layout="BBBH"), command(2, 0x04, 0x23, 3, 512, layout="BBBH")]
    wrong += [
        command(4, 0, layout="H"),
        command(5, 1, 9, 0, layout="HHB"),
        command(5, 0, 9, 0, layout="HHB"),
        command(6),
    ]
    wrong += [command(8, 9, 200, layout="BH"), command(8, 2, 1, layout="BH"), command(11, 0, layout="B"), command(13)]
    wrong += [command(12), encode_frame(0x481, b"12345678"), encode_frame(0x401, b"12"), command(3, 7, layout="I")]
    missing = command(2, 0x02, 0x23, 2, 512, layout="BBBH") + command(3, 7, layout="I")
    spoilt = uploaded(fitting(1)) + command(2, 0x02, 0x23, 2, 512, layout="BBBH")
    spoilt += b"".join(encode_frame(0x381, bytes([k]) + bytes(7)) for k in range(3)) + command(3, 7, layout="I")
    alarm = bytes([0xFE]) + command(4, 200, layout="H") + bytes([0xFE])
    held = bytes([0xFD]) + command(7) + bytes([0xFD]) + command(7)
    wrong += [missing, spoilt, alarm, held]
    taken = command(4, 200, layout="H") + SECOND * 2 + other
    return b"\0" + b"".join(wrong) + taken


def more_seeds() -> dict[str, bytes]:
    bumper, button, battery, fault = (bytes([k]) for k in (0xFE, 0xFB, 0xFA, 0xFC))
    period = bytes([0xF9]) * 40
    return {
        "onboard": onboard(0, b""),
        "onboard-bumper": onboard(0, bumper + period + bumper),
        "onboard-battery": onboard(0, (battery + period * 2) + battery),
        "onboard-fault": onboard(0, fault + period + fault),
        "onboard-stop": onboard(0, command(0x66)),
        "onboard-late": onboard(0, SECOND),
        "store-fails": onboard(4, b""),
        "no-store": onboard(16, b"") + command(0x4B, 4, layout="B"),
        "latched": onboard(8 | 32, command(0x57)),
        "guarded": onboard(8 | 64, b""),
        "after-reset": onboard(8, b""),
        "autorun": unplugged(200, SECOND * 4 + period + button + period + button),
        "autorun-hello": unplugged(200, SECOND * 4 + period + HELLO),
        "no-network": b"\0" + HELLO + command(0x34, 200, layout="H") + command(0x45, 5, 20, 2, layout="HHB"),
        "by-button": unplugged(0x8000 | 200, period + button + period + button + period + button + period),
        "refusals": refusals(),
        "unfitting": onboard(0, b"").replace(uploaded(fitting(1)), uploaded(image_of(4, 1))),
        "other-body": unplugged(200, SECOND * 4, image_of(4, 1)),
        "repeated": onboard(0, command(0x45, 5, 20, 0x70, layout="HHB") + command(0x46, 7, 20, 0x70, layout="HHB")),
        "again": onboard(0, b"") + command(0x34, 200, layout="H") + command(0x45, 5, 20, 0x70, layout="HHB"),
        "many-trials": uploaded_many(),
    }


def seeds() -> dict[str, bytes]:
    talks = {f"conversation-{seed}": conversation(seed) for seed in range(6)}
    estop = {"estop": b"\0" + encode_frame(0, b"") + bytes([0xFD, 0xFD]) + command(7)}
    return {**talks, **{f"store-{seed}": stored(seed) for seed in range(2)}, **estop, **more_seeds()}


def test_the_corpus_holds_the_real_conversations() -> None:
    for name, content in seeds().items():
        assert (CORPUS / name).read_bytes() == content, f"{name}: run python -m tests.firmware.test_fuzz 0"


def test_a_bounded_run_finds_nothing(tmp_path: Path) -> None:
    found = tmp_path / "found"
    found.mkdir()
    limits = [f"-runs={RUNS}", "-seed=1", "-max_len=1400", "-timeout=10", f"-artifact_prefix={tmp_path}/"]
    done = subprocess.run([build(), *limits, found, CORPUS], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-4000:]
    assert f"Done {RUNS} runs" in done.stderr


def test_a_conversation_reaches_a_running_trial(tmp_path: Path) -> None:
    """The corpus is worth something: without it the fuzzer covers less than half as much."""
    covered = []
    for corpus in (CORPUS, tmp_path):
        done = subprocess.run([build(), "-runs=1", "-seed=1", corpus], capture_output=True, text=True, check=True)
        line = [row for row in done.stderr.splitlines() if "cov:" in row][-1]
        covered.append(int(line.split("cov:")[1].split()[0]))
    assert covered[0] > 2 * covered[1]


def test_the_corpus_covers_the_core(tmp_path: Path) -> None:
    """More than 97 % of all lines of the core (the store in flash has tests of its own)."""
    gcc, gcov = find_tool("gcc", "gcc"), find_tool("gcov", "gcc")
    core = [path for path in sorted((FIRMWARE / "src").glob("*.c")) if path.name != "sceann_flash.c"]
    sources = [HERE / "c" / "fuzz.c", HERE / "c" / "replay.c", *core]
    command = [gcc, "-std=c99", "-O0", "--coverage", f"-I{FIRMWARE / 'src'}", *sources, "-o", tmp_path / "replay"]
    subprocess.run(command, cwd=tmp_path, check=True)
    subprocess.run([tmp_path / "replay", *sorted(CORPUS.iterdir())], cwd=tmp_path, check=True)
    notes = sorted(tmp_path.glob("*sceann_*.gcno"))
    told = subprocess.run([gcov, "-n", *notes], cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    of_core = re.findall(r"File '[^']*/src/sceann_\w+\.c'\nLines executed:([\d.]+)% of (\d+)", told)
    assert len(of_core) == len(core)
    lines = sum(int(n) for _, n in of_core)
    covered = sum(float(part) / 100 * int(n) for part, n in of_core)
    assert covered / lines > 0.97, told


def main(seconds: int) -> None:
    CORPUS.mkdir(exist_ok=True)
    for name, content in seeds().items():
        (CORPUS / name).write_bytes(content)
    if seconds:
        subprocess.run([build(), f"-max_total_time={seconds}", "-max_len=1400", CORPUS], check=False, cwd=CORPUS.parent)


if __name__ == "__main__":
    main(int(sys.argv[1]))

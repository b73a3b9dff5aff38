"""Frame parser, command handler, genome loader and store under libFuzzer with address and undefined-behaviour checks.

The corpus in ``fuzz/`` is made of real conversations (`seeds`); what a longer run finds belongs there too:

    python -m tests.firmware.test_fuzz 600
"""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib
from pathlib import Path

import numpy as np

from sceann_hil.firmware.build import FIRMWARE, HOST_CLANG, compile_c
from sceann_hil.link.framing import encode_frame
from sceann_hil.link.messages import load_arguments
from sceann_hil.link.numbers import LINK_VERSION
from sceann_hil.network.controller import ARITHMETIC_ID
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


def seeds() -> dict[str, bytes]:
    talks = {f"conversation-{seed}": conversation(seed) for seed in range(6)}
    estop = {"estop": b"\0" + encode_frame(0, b"") + bytes([0xFD, 0xFD]) + command(7)}
    return {**talks, **{f"store-{seed}": stored(seed) for seed in range(2)}, **estop}


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


def main(seconds: int) -> None:
    CORPUS.mkdir(exist_ok=True)
    for name, content in seeds().items():
        (CORPUS / name).write_bytes(content)
    if seconds:
        subprocess.run([build(), f"-max_total_time={seconds}", "-max_len=1400", CORPUS], check=False, cwd=CORPUS.parent)


if __name__ == "__main__":
    main(int(sys.argv[1]))

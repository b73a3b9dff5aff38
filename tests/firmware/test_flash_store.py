"""The two-sector store: power cut at every byte programmed and in every erasure."""

from __future__ import annotations

import subprocess
from pathlib import Path

from sceann_hil.firmware.build import FIRMWARE, HOST_GCC, compile_c

HERE = Path(__file__).parent / "c"
SOURCES = [FIRMWARE / "src" / name for name in ("sceann_flash.c", "sceann_crc.c", "sceann_wire.c")]


def test_a_power_cut_at_every_byte_leaves_the_old_bytes_or_the_new_ones() -> None:
    program = compile_c(HOST_GCC, [HERE / "flash_cuts.c", *SOURCES], include=[FIRMWARE / "src"])
    done = subprocess.run([program], capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stdout
    assert int(done.stdout) > 10_000

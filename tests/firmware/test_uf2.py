"""UF2 files, read back as the Pico's ROM does."""

from __future__ import annotations

import struct

import numpy as np

from sceann_hil.firmware.uf2 import FLASH_START, RP2040, uf2


def test_blocks_hold_the_whole_image_in_order() -> None:
    flash = np.random.default_rng(1).integers(0, 256, 1000).astype(np.uint8).tobytes()
    data = uf2(flash)
    assert len(data) == 4 * 512
    memory = b""
    for k in range(4):
        block = data[512 * k : 512 * k + 512]
        first, second, flags, address, size, number, total, family = struct.unpack("<8I", block[:32])
        assert (first, second, flags, family) == (0x0A324655, 0x9E5D5157, 0x2000, RP2040)
        assert (address, size, number, total) == (FLASH_START + 256 * k, 256, k, 4)
        assert struct.unpack("<I", block[508:]) == (0x0AB16F30,)
        memory += block[32 : 32 + size]
    assert memory[:1000] == flash

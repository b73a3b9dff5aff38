"""UF2: the file that is dragged onto a Raspberry Pi Pico's drive (https://github.com/microsoft/uf2)."""

from __future__ import annotations

import struct

_BLOCK = struct.Struct("<8I476sI")
_MAGIC = (0x0A324655, 0x9E5D5157, 0x0AB16F30)
_FAMILY_PRESENT = 0x2000
_PAYLOAD = 256
RP2040 = 0xE48BFF56
FLASH_START = 0x1000_0000


def uf2(flash: bytes, family: int = RP2040, start: int = FLASH_START) -> bytes:
    """Content of flash from `start` on, as UF2 blocks of 256 bytes."""
    parts = [flash[at : at + _PAYLOAD].ljust(_PAYLOAD, b"\0") for at in range(0, len(flash), _PAYLOAD)]
    return b"".join(
        _BLOCK.pack(
            *(_MAGIC[0], _MAGIC[1], _FAMILY_PRESENT, start + k * _PAYLOAD),
            *(_PAYLOAD, k, len(parts), family, part, _MAGIC[2]),
        )
        for k, part in enumerate(parts)
    )

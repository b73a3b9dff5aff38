"""Arrays that took long to compute, kept by content: each file says by a checksum whether it is whole."""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

_MAGIC = b"sceann transfer 1\n"
_DIGEST_BYTES = 32
MOST_BYTES = 1 << 30
"""Of the whole cache; what was not used for the longest time goes first."""


def cache_folder(kind: str, digest: str) -> Path:
    """Where arrays of one kind and content are; the folder may not exist."""
    return Path(platformdirs.user_cache_path("sceann-hil")) / "transfer" / f"{kind}-{digest}"


def digest_of(*parts: bytes | str) -> str:
    """Of everything that decides what is in a file."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode() if isinstance(part, str) else part
        digest.update(len(data).to_bytes(8, "little"))
        digest.update(data)
    return digest.hexdigest()[:32]


def save(path: Path, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write arrays whole or not at all.

    Raises:
        OSError: they cannot be written.
    """
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)  # type: ignore[arg-type]  # its stub knows of no names that are not literal
    data = buffer.getvalue()
    path.parent.mkdir(parents=True, exist_ok=True)
    making = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        making.write_bytes(_MAGIC + hashlib.sha256(data).digest() + data)
        making.replace(path)
    finally:
        making.unlink(missing_ok=True)


def load(path: Path) -> dict[str, NDArray[Any]] | None:
    """The arrays, or None if there is no such file or it is damaged: they must be made again."""
    try:
        data = path.read_bytes()
    except OSError:
        return None
    head = len(_MAGIC) + _DIGEST_BYTES
    digest, content = data[len(_MAGIC) : head], data[head:]
    if not data.startswith(_MAGIC) or hashlib.sha256(content).digest() != digest:
        return None
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return dict(arrays)


def prune(keep: Path, most_bytes: int = MOST_BYTES) -> None:
    """Remove what was not used for the longest time until the cache is small enough; never the folder `keep`."""
    root = keep.parent
    if not root.is_dir():
        return
    files = sorted((path for path in root.glob("*/*") if path.is_file()), key=lambda path: path.stat().st_atime)
    size = sum(path.stat().st_size for path in files)
    for path in files:
        if size <= most_bytes:
            return
        if path.parent != keep:
            size -= path.stat().st_size
            path.unlink(missing_ok=True)

"""Numba, set up once: which options every compiled function gets, and where compiled code is kept.

Numba notices a change in the file of a compiled function, but not in the files of the functions that it calls. The
cache folder therefore carries a hash of every source file that holds compiled code: an edit or an upgrade can never
run yesterday's machine code, and an installation that cannot be written to still has a cache.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs

_Function = TypeVar("_Function", bound=Callable[..., Any])


def _source_fingerprint() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    root = Path(__file__).parents[2]
    for package in ("sceann_hil", "backends"):
        for path in sorted((root / package).rglob("*.py")):
            source = path.read_bytes()
            if b"compiled" in source:
                digest.update(source)
    return digest.hexdigest()[:16]


numba.config.CACHE_DIR = str(platformdirs.user_cache_path("sceann-hil") / _source_fingerprint())  # type: ignore[attr-defined]


def compiled(function: _Function) -> _Function:
    """Compile `function` to machine code at its first call and keep the code on disk.

    Integer and IEEE floating-point semantics stay exact (no fast-math, no contraction), so that a result depends on
    neither the machine's vector width nor on how trials are batched. The GIL is released.
    """
    return cast(_Function, numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def compiled_part(function: _Function) -> _Function:
    """Like `compiled`, for the pieces that only other compiled functions call; they need no cache of their own."""
    return cast(_Function, numba.njit(error_model="numpy", forceinline=True)(function))

"""Machine code kept on disk under everything that decides what it computes.

Numba's own cache knows a function's file, but not the files of the functions that it calls, and takes whatever it finds
in its folder for machine code. Here the key is the `fingerprint` of the function, and a damaged file is made again.
"""

from __future__ import annotations

import contextlib
import hashlib
import pickle
import re
import sys
from operator import attrgetter
from pathlib import Path
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import numba
from numba.core import compiler, serialize
from numba.core.caching import _Cache

from sceann_hil import derived
from sceann_hil.network.fingerprint import fingerprint

_has_dynamic_globals = attrgetter("library.has_dynamic_globals")
"""Code with addresses of this process in it, such as those of large global arrays."""


class CodeCache(_Cache):
    """What `numba.core.dispatcher.Dispatcher` asks for machine code before it compiles, and gives it to afterwards.

    Args:
        dispatcher: the compiled function.
    """

    def __init__(self, dispatcher: Any) -> None:
        self._dispatcher = dispatcher
        self._name = re.sub(r"\W+", "_", dispatcher.py_func.__qualname__)
        self._enabled = True

    @property
    def cache_path(self) -> str:
        return str(derived.folder("code"))

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        if not self._enabled:
            return None
        target_context.refresh()
        path = self._path(sig, target_context.codegen())
        data = derived.read(path)
        if data is None:
            return None
        try:
            rebuild: Any = compiler.CompileResult._rebuild
            return rebuild(target_context, *pickle.loads(data))
        except Exception:
            # whole, but not of this compiler: the same as nothing
            derived.remove(path)
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        if self._enabled and not _has_dynamic_globals(data) and all(loop.can_cache for loop in data.lifted):
            dumps: Any = serialize.dumps
            # Numba has no object code to give where another thread compiles the same function at this moment
            with contextlib.suppress(RuntimeError):
                derived.write(self._path(sig, data.codegen), dumps(data._reduce()))

    def enable(self) -> None:
        self._enabled = True

    def disable(self) -> None:
        self._enabled = False

    def flush(self) -> None:
        """Throw away what is kept of this function, in any form."""
        with contextlib.suppress(OSError):
            for path in Path(self.cache_path).glob(f"{self._name}-*"):
                derived.remove(path)

    def _path(self, sig: Any, codegen: Any) -> Path:
        versions = (numba.__version__, llvmlite.__version__, sys.version)
        key = (versions, codegen.magic_tuple(), str(sig), fingerprint(self._dispatcher))
        digest = hashlib.sha256(repr(key).encode()).hexdigest()[:24]
        return derived.folder("code") / f"{self._name}-{digest}"

"""Machine code kept on disk under everything that decides what it computes.

Numba's own cache knows a function's file, but not the files of the functions that it calls, and takes whatever it finds
in its folder for machine code. Here the key is the `fingerprint` of the function, and a damaged file is made again.
"""

from __future__ import annotations

import contextlib
import hashlib
import importlib
import io
import pickle
import re
import sys
from operator import attrgetter
from pathlib import Path
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import numba
from numba.core import compiler, environment, serialize
from numba.core.caching import _Cache
from numba.core.runtime import nrt

from sceann_hil import derived
from sceann_hil.network.fingerprint import fingerprint

_has_dynamic_globals = attrgetter("library.has_dynamic_globals")
"""Code with addresses of this process in it, such as those of large global arrays."""


_NEEDS_A_COMPILER = b"_numba_hashsecret"
"""In machine code: a symbol that only a whole compiler gives an address to."""


def _make_ready(target_context: Any, data: bytes) -> None:
    """What machine code needs before it can be loaded.

    Numba refreshes its compiler here, which takes as long as all else of a short run and imports SciPy. Code that is
    compiled already needs the memory functions only; whatever has to be compiled later refreshes the compiler itself.
    """
    if _NEEDS_A_COMPILER in data:
        target_context.refresh()
    else:
        nrt.rtsys.initialize(target_context)


class _Unpickler(pickle.Unpickler):
    """Reads what Numba's compiler has pickled without importing the parts of the compiler that it came from."""

    def find_class(self, module: str, name: str) -> Any:
        if (module, name) == (environment.__name__, environment._rebuild_env.__name__):
            return _environment
        return super().find_class(module, name)


def _environment(module: str, constants: list[Any], name: str) -> Any:
    """As Numba's: only code that is not compiled wholly looks for names in the module that it stood in."""
    memo: Any = environment.Environment._memo
    if (known := memo.get(name)) is not None:
        return known
    skipped = module.startswith("numba.") and module not in sys.modules
    names = {"__name__": module} if skipped else importlib.import_module(module).__dict__
    made: Any = environment.Environment(names)
    made.consts[:] = constants
    made.env_name = name
    memo[name] = made
    return made


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
        path = self._path(sig, target_context.codegen())
        data = derived.read(path)
        if data is None:
            return None
        _make_ready(target_context, data)
        try:
            rebuild: Any = compiler.CompileResult._rebuild
            return rebuild(target_context, *_Unpickler(io.BytesIO(data)).load())
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

"""One number for everything that decides what a function computes: its code, its constants, and all that it calls.

Machine code is kept under it, and a journal notes it: an edit to a body, to a constant of its module or to a helper in
another module gives another one. Comments, docstrings, annotations and places in a file do not count.
"""

from __future__ import annotations

import dis
import functools
import hashlib
import re
import sys
from collections.abc import Iterator
from enum import Enum
from types import BuiltinFunctionType, CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

_FOREIGN = frozenset(sys.stdlib_module_names) | {"numpy", "numba", "llvmlite", "scipy"}
"""Packages whose functions are known by name; their versions are noted elsewhere."""
_ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")


def fingerprint(*roots: object) -> str:
    """16 hexadecimal digits for functions, constants, and what they lead to.

    Args:
        roots: functions (compiled or not), classes whose own methods count, constants.
    """
    return _Walk().digest(roots)


def reached(*roots: object) -> list[Any]:
    """Every compiled function that `roots` call, however far away, callees before callers."""
    walk = _Walk()
    walk.digest(roots)
    return walk.dispatchers


def is_dispatcher(value: object) -> bool:
    """True for what Numba makes of a function."""
    return hasattr(value, "py_func") and hasattr(value, "targetoptions")


class _Walk:
    def __init__(self) -> None:
        self._hash = hashlib.sha256(f"{sys.implementation.cache_tag}".encode())
        self._seen: dict[int, int] = {}
        self._kept: list[object] = []
        self.dispatchers: list[Any] = []

    def digest(self, roots: tuple[object, ...]) -> str:
        for root in roots:
            self._add(root)
        return self._hash.hexdigest()[:16]

    def _token(self, *parts: object) -> None:
        self._hash.update(repr(parts).encode("utf-8", "surrogatepass") + b"\n")

    def _is_new(self, value: object) -> bool:
        """Whether it is met for the first time; functions may call each other."""
        number = self._seen.setdefault(id(value), len(self._seen))
        if number < len(self._kept):
            self._token("again", number)
            return False
        self._kept.append(value)
        return True

    def _add(self, value: object) -> None:
        if isinstance(value, Enum):
            self._token(type(value).__qualname__, value.name)
            self._add(value.value)
        elif value is None or isinstance(value, bool | int | float | complex | str | bytes):
            self._token(type(value).__name__, value)
        elif isinstance(value, np.generic):
            self._token(value.dtype.str, value.tobytes())
        elif isinstance(value, np.ndarray):
            self._token(value.dtype.str, value.shape)
            self._token(value.tolist() if value.dtype.hasobject else value.tobytes())
        elif isinstance(value, tuple | list):
            self._token(type(value).__name__, len(value))
            for one in value:
                self._add(one)
        elif isinstance(value, frozenset | set):
            self._token("set", sorted(map(repr, value)))
        elif isinstance(value, dict):
            self._token("dict", len(value))
            for key, one in value.items():
                self._add(key)
                self._add(one)
        else:
            self._add_code(value)

    def _add_code(self, value: object) -> None:
        if is_dispatcher(value):
            self._dispatcher(value)
        elif isinstance(value, staticmethod | classmethod | MethodType):
            self._add(value.__func__)
        elif isinstance(value, property):
            self._add((value.fget, value.fset))
        elif isinstance(value, functools.cached_property):
            self._add(value.func)
        elif isinstance(value, functools.partial):
            self._add((value.func, value.args, value.keywords))
        elif isinstance(value, FunctionType):
            self._function(value)
        elif isinstance(value, type):
            self._class(value)
        elif isinstance(value, ModuleType):
            self._token("module", value.__name__)
        elif isinstance(value, BuiltinFunctionType | np.ufunc):
            self._token("builtin", value.__name__)
        elif (inner := getattr(value, "py_func", None) or getattr(value, "_dispatcher", None)) is not None:
            self._add(inner)
        else:
            self._token(type(value).__qualname__, _ADDRESS.sub("", repr(value)))

    def _dispatcher(self, value: Any) -> None:
        if self._is_new(value):
            self._token("compiled", sorted(map(repr, value.targetoptions.items())))
            self._function(value.py_func)
            self.dispatchers.append(value)

    def _function(self, function: FunctionType) -> None:
        if _is_foreign(function.__module__):
            self._token("function", function.__module__, function.__qualname__)
        elif self._is_new(function):
            self._code(function.__code__, function.__globals__, function.__doc__)
            self._add((function.__defaults__, function.__kwdefaults__))
            for cell in function.__closure__ or ():
                try:
                    self._add(cell.cell_contents)
                except ValueError:
                    self._token("empty cell")

    def _code(self, code: CodeType, names: dict[str, Any], doc: str | None) -> None:
        self._token(code.co_code, code.co_flags, code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount)
        self._token(code.co_names, code.co_freevars, code.co_cellvars)
        constants = code.co_consts
        if doc is not None and constants[:1] == (doc,):
            constants = constants[1:]
        for constant in constants:
            if isinstance(constant, CodeType):
                self._code(constant, names, None)
            else:
                self._add(constant)
        for name in _global_names(code):
            self._token("global", name)
            if name not in names:
                continue
            value = names[name]
            if isinstance(value, ModuleType):
                self._module(value, code.co_names)
            else:
                self._add(value)

    def _module(self, module: ModuleType, names: tuple[str, ...]) -> None:
        """A module's attributes among `names`; those of its submodules too."""
        self._token("module", module.__name__)
        if _is_foreign(module.__name__):
            return
        for name in names:
            value = vars(module).get(name, self)
            if isinstance(value, ModuleType) and value is not module:
                self._module(value, names)
            elif value is not self:
                self._token("attribute", name)
                self._add(value)

    def _class(self, kind: type) -> None:
        self._token("class", kind.__qualname__)
        if _is_foreign(kind.__module__) or not self._is_new(kind):
            return
        if issubclass(kind, Enum):
            for member in kind:
                self._add(member)
            return
        for name, value in sorted(vars(kind).items()):
            if name in ("__init__", "__call__") or not (name.startswith("__") or name == "_abc_impl"):
                self._token("member", name)
                self._add(value)


def _global_names(code: CodeType) -> Iterator[str]:
    names = {i.argval for i in dis.get_instructions(code) if i.opname in ("LOAD_GLOBAL", "LOAD_NAME")}
    return iter(sorted(names))


def _is_foreign(module: str | None) -> bool:
    return module is not None and module.partition(".")[0] in _FOREIGN and module != "__main__"

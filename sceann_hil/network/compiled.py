"""Numba, set up once: which options every compiled function gets, and where compiled code is kept."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any, TypeVar, cast
from weakref import WeakKeyDictionary

import numba

from sceann_hil.network.code_cache import CodeCache
from sceann_hil.network.fingerprint import fingerprint, is_dispatcher, reached

_Function = TypeVar("_Function", bound=Callable[..., Any])

# whatever the environment says: interpreted integers do not wrap around like compiled ones
numba.config.DISABLE_JIT = 0  # type: ignore[attr-defined]

_bound: dict[tuple[Callable[..., Any], str], Callable[..., Any]] = {}

_compiled_as: WeakKeyDictionary[Any, str] = WeakKeyDictionary()
"""The fingerprint with which a part was current when something that uses it was compiled."""


def compiled(function: _Function) -> _Function:
    """Compile `function` to machine code at its first call and keep the code on disk.

    Integer and IEEE floating-point semantics stay exact (no fast-math, no contraction), so that a result depends on
    neither the machine's vector width nor on how trials are batched. The GIL is released.
    """
    dispatcher: Any = numba.njit(nogil=True, error_model="numpy")(function)
    dispatcher._cache = CodeCache(dispatcher)
    return cast(_Function, dispatcher)


def compiled_part(function: _Function) -> _Function:
    """Like `compiled`, for the pieces that only other compiled functions call; they need no cache of their own."""
    return cast(_Function, numba.njit(error_model="numpy", forceinline=True)(function))


def guarded_part(function: _Function) -> _Function:
    """A `compiled_part` of somebody else that gets an IndexError instead of whatever lies behind an array."""
    return cast(_Function, numba.njit(error_model="numpy", forceinline=True, boundscheck=True)(function))


def rebound(function: _Function, **parts: Callable[..., Any]) -> _Function:
    """A copy of a module's function that calls `parts` by these names.

    The names stand in a globals dictionary of its own: unlike a closure, that lets machine code be kept on disk.
    """
    plain: Any = function
    return cast(_Function, FunctionType(plain.__code__, {**plain.__globals__, **parts}, plain.__name__))


def bound(function: _Function, **parts: Callable[..., Any]) -> _Function:
    """The machine code of `rebound`; made once for the same parts, and anew when something in them has changed."""
    key = function, fingerprint(*parts.values())
    if key not in _bound:
        make_current(*parts.values())
        _bound[key] = compiled(rebound(function, **parts))
    return cast(_Function, _bound[key])


def as_part(function: _Function) -> _Function:
    """A function of somebody else for use in compiled code: compiled already, or plain Python."""
    return function if is_dispatcher(function) else compiled_part(function)


def make_current(*functions: Callable[..., Any]) -> None:
    """See to it that what these functions call is compiled as it is now, not as it was in this process before.

    A constant of a module may have been changed, or a helper's module imported again, since a part was compiled.
    """
    for part in reached(*functions):
        now = fingerprint(part)
        if _compiled_as.get(part, now) != now:
            part._make_finalizer()()
            part._reset_overloads()
        _compiled_as[part] = now
        if not isinstance(part._cache, CodeCache) and part._cache.cache_path is not None:
            # kept by Numba itself, which does not notice edits to what the part calls
            part._cache = CodeCache(part)

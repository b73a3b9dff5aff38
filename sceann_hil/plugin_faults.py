"""Whose fault an error is: a plug-in's, with its package and the line in it, or ours."""

from __future__ import annotations

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import metadata
from types import TracebackType

from sceann_hil.errors import PluginError, as_user_error

_GROUPS = ("sceann_hil.robots", "sceann_hil.tasks", "sceann_hil.algorithms", "sceann_hil.commands")
_OURS = {"sceann_hil", "backends"}


def plugin_fault(error: BaseException) -> PluginError | None:
    """What to tell of an error that escaped from a plug-in; None if it is ours, or a user's.

    The fault is where the innermost frame is that belongs to a plug-in or to us: a library that a plug-in called
    wrongly is the plug-in's business.
    """
    if as_user_error(error) is not None or not isinstance(error, Exception):
        return None
    packages = _packages()
    for frame in reversed(list(_frames(error.__traceback__))):
        module = str(frame.tb_frame.f_globals.get("__name__", "")).partition(".")[0]
        if module in _OURS:
            return None
        if module in packages:
            code = frame.tb_frame.f_code
            said = "".join(traceback.format_exception_only(error)).strip()
            return PluginError(
                f"The package {packages[module]} failed: {said} ({code.co_filename}, line {frame.tb_lineno}, in "
                f"{code.co_name}).",
                "This is no fault in sceann. Repair, update or uninstall the package; `sceann --traceback ...` shows "
                "where the error came from, for its authors.",
            )
    return None


@contextmanager
def blamed_on_plugins() -> Iterator[None]:
    """Errors of plug-ins leave the block as `PluginError`, which survives the way between processes.

    Raises:
        PluginError: in place of an error that is a plug-in's.
    """
    try:
        yield
    except Exception as error:
        fault = plugin_fault(error)
        if fault is None:
            raise
        raise fault from error


def _frames(trace: TracebackType | None) -> Iterator[TracebackType]:
    while trace is not None:
        yield trace
        trace = trace.tb_next


def _packages() -> dict[str, str]:
    """Top-level module of every installed plug-in that is not ours, and the name and version of its package."""
    return {
        entry.module.partition(".")[0]: f"{entry.dist.name} {entry.dist.version}" if entry.dist else entry.module
        for group in _GROUPS
        for entry in metadata.entry_points(group=group)
        if entry.module.partition(".")[0] not in _OURS
    }

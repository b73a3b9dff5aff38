"""What a command finds in its environment, left there for other programs, and what is done about it.

Shells, notebooks, desktops and older tools export variables that the libraries and programs below us obey: a number of
threads that is no number, a folder for temporary files that is gone, options for another version of Node.js. None of
them was meant for us, so that none may end a command, and none may silently switch off what was asked for here.
"""

from __future__ import annotations

import os
from collections.abc import MutableMapping


def _is_a_positive_number(value: str) -> bool:
    try:
        return int(value) > 0
    except ValueError:
        return False


_NEVER_OURS = (
    # a drawing backend with windows, or one that is not installed: our figures are files
    "MPLBACKEND",
    # "off" makes every recording empty; whether a run is recorded is said by --record
    "RERUN",
    # where compilers look for their parts and for other people's headers; one of them writes files as well
    "GCC_EXEC_PREFIX",
    "COMPILER_PATH",
    "CPATH",
    "C_INCLUDE_PATH",
    "CPLUS_INCLUDE_PATH",
    "LIBRARY_PATH",
    "DEPENDENCIES_OUTPUT",
    "SUNPRO_DEPENDENCIES",
    # options and modules for somebody else's Node.js
    "NODE_OPTIONS",
    "NODE_PATH",
)
_POSITIVE_NUMBERS = (
    "NUMBA_NUM_THREADS",
    "TERMINAL_WIDTH",
    "RERUN_FLUSH_NUM_BYTES",
    "RERUN_CHUNK_MAX_BYTES",
    "RERUN_CHUNK_MAX_ROWS",
)
"""Variables that are heard if that is what they are."""
_TEMPORARY_FOLDER = ("TMPDIR", "TEMP", "TMP")

_COMPLETION = "_SCEANN_COMPLETE"
_WORDS_TO_COMPLETE = {"COMP_WORDS", "_TYPER_COMPLETE_ARGS"}
"""A shell that wants a word completed says so in the one, and sends the line in one of the others."""


def set_right(environment: MutableMapping[str, str] = os.environ) -> None:
    """Take out what was not meant for us or makes no sense; before any library is imported that would read it.

    Args:
        environment: this process's own, which its children inherit too.
    """
    for name in _NEVER_OURS:
        environment.pop(name, None)
    for name in _POSITIVE_NUMBERS:
        if name in environment and not _is_a_positive_number(environment[name]):
            del environment[name]
    if not _WORDS_TO_COMPLETE & environment.keys():
        environment.pop(_COMPLETION, None)
    _find_temporary_folder(environment)


def _find_temporary_folder(environment: MutableMapping[str, str]) -> None:
    """Python looks for another folder if the named one is gone; the programs that it starts do not."""
    named = [name for name in _TEMPORARY_FOLDER if name in environment]
    if not named:
        return
    import tempfile

    try:
        found = tempfile.gettempdir()
    except OSError:
        return  # there is none: whoever needs one says so
    for name in named:
        environment[name] = found

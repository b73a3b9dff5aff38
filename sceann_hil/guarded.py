"""Programs that end with the process that started them, however that ends."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import IO

_KEEPER = (
    'exec 3<&0 </dev/null; "$@" 3<&- & program=$!; '
    '{ read -r _; kill "$program"; sleep 2; kill -9 "$program"; } <&3 >/dev/null 2>&1 & waiter=$!; exec 3<&-; '
    'wait "$program"; code=$?; kill "$waiter" 2>/dev/null; exit $code'
)
"""A shell that ends with the program and its exit code, and ends it when its input does: our end of a pipe."""


@contextmanager
def guarded(
    command: Sequence[str],
    output: IO[bytes] | int | None,
    environment: Mapping[str, str] | None = None,
    pass_fds: Sequence[int] = (),
) -> Iterator[subprocess.Popen[bytes]]:
    """A program for as long as the block lasts, and no longer than this process lives.

    Args:
        command: program and arguments.
        output: where its output and errors go, as `subprocess` has it; None for this process's own.
        environment: its own; None for this process's.
        pass_fds: descriptors that it inherits, none on Windows.

    Returns:
        A process that ends when the program does, with its exit code.
    """
    if sys.platform == "win32":
        # no shell there: a program is ended with the block, but outlives a process that is killed
        with subprocess.Popen(
            list(command),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=None if output is None else subprocess.STDOUT,
            env=None if environment is None else dict(environment),
        ) as process:
            try:
                yield process
            finally:
                process.kill()
        return
    theirs, ours = os.pipe()
    try:
        process = subprocess.Popen(
            ["/bin/sh", "-c", _KEEPER, "keeper", *command],
            stdin=theirs,
            stdout=output,
            stderr=None if output is None else subprocess.STDOUT,
            env=None if environment is None else dict(environment),
            pass_fds=pass_fds,
        )
    except BaseException:
        os.close(ours)
        raise
    finally:
        os.close(theirs)
    try:
        yield process
    finally:
        os.close(ours)
        process.wait()

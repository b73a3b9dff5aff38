"""Programs that end with the process that started them, however that ends."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import IO

from sceann_hil.errors import ToolMissing

_KEEPER = 'exec 3<&0 </dev/null; "$@" 3<&- & read -r _ <&3; kill -9 $! 2>/dev/null; wait $! 2>/dev/null'
"""A shell that waits for the end of its input, which is this process's end of a pipe, and then ends the program."""


_REPORTING_KEEPER = (
    'exec 3<&0 </dev/null; "$@" 3<&- & program=$!; '
    '{ read -r _; kill "$program"; sleep 2; kill -9 "$program"; } <&3 >/dev/null 2>&1 & waiter=$!; exec 3<&-; '
    'wait "$program"; code=$?; kill "$waiter" 2>/dev/null; exit $code'
)
"""The same, but it ends with the program too, and with its exit code."""


@contextmanager
def guarded(
    command: Sequence[str], output: IO[bytes] | None, environment: Mapping[str, str]
) -> Iterator[subprocess.Popen[bytes]]:
    """A program for as long as the block lasts, and no longer than this process lives.

    Args:
        command: program and arguments.
        output: where its output and errors go; None for this process's own.
        environment: its own.

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
            env=dict(environment),
        ) as process:
            try:
                yield process
            finally:
                process.kill()
        return
    theirs, ours = os.pipe()
    try:
        process = subprocess.Popen(
            ["/bin/sh", "-c", _REPORTING_KEEPER, "keeper", *command],
            stdin=theirs,
            stdout=output,
            stderr=None if output is None else subprocess.STDOUT,
            env=dict(environment),
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


def _needs_a_shell() -> None:
    if sys.platform == "win32":
        raise ToolMissing("Emulated boards need a POSIX system.", "Use Linux, or a board of your own.")


class GuardedProcess:
    """A program without input and output.

    Args:
        command: program and arguments.
        pass_fds: descriptors that it inherits.

    Attributes:
        keeper: the process that ends it.

    Raises:
        ToolMissing: on Windows.
    """

    def __init__(self, command: Sequence[str], pass_fds: Sequence[int] = ()) -> None:
        _needs_a_shell()
        theirs, self._ours = os.pipe()
        try:
            self.keeper = subprocess.Popen(
                ["/bin/sh", "-c", _KEEPER, "keeper", *command],
                stdin=theirs,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                pass_fds=pass_fds,
            )
        except BaseException:
            os.close(self._ours)
            raise
        finally:
            os.close(theirs)

    def end(self) -> None:
        """End it; may be called twice."""
        if self._ours >= 0:
            os.close(self._ours)
            self._ours = -1
        self.keeper.wait()

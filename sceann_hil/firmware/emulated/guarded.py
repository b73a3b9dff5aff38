"""Programs that end with the process that started them, however that ends."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence

_KEEPER = 'exec 3<&0 </dev/null; "$@" 3<&- & read -r _ <&3; kill -9 $! 2>/dev/null; wait $! 2>/dev/null'
"""A shell that waits for the end of its input, which is this process's end of a pipe, and then ends the program."""


class GuardedProcess:
    """A program without input and output.

    Args:
        command: program and arguments.
        pass_fds: descriptors that it inherits.

    Attributes:
        keeper: the process that ends it.
    """

    def __init__(self, command: Sequence[str], pass_fds: Sequence[int] = ()) -> None:
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

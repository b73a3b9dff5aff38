"""What the `sceann` command begins with: Ctrl-C ends it quietly, also before there is anything to end.

A command imports for some tenths of a second, on a busy computer for longer. Whoever changes their mind meanwhile shall
not be shown where in Python's library that was.
"""

from __future__ import annotations

import os
import signal
from types import FrameType


def main() -> None:
    """Run the command line."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)
    from sceann_hil.cli import main as run

    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    run()


def _leave(_signal: int, _frame: FrameType | None) -> None:
    # `ExitCode.INTERRUPTED_NOW`; nothing is open yet that would have to be closed
    os._exit(130)

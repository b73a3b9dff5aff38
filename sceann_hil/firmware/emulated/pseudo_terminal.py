"""A port without a cable: both ends of a pseudo-terminal."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from sceann_hil.errors import ToolMissing


def needs_pseudo_terminals() -> None:
    """Refuse what cannot work on this system.

    Raises:
        ToolMissing: it has no pseudo-terminals.
    """
    if sys.platform == "win32":
        raise _missing()


def open_pseudo_terminal(*, waits: bool = True) -> tuple[int, int, Path]:
    """Our end, the other end and the other end's path. Bytes go through as they are.

    Args:
        waits: reading from our end waits for bytes.

    Raises:
        ToolMissing: this system has none.
    """
    if sys.platform == "win32":
        raise _missing()
    # POSIX only
    import pty
    import tty

    near, far = pty.openpty()
    tty.setraw(far)
    os.set_blocking(near, waits)
    return near, far, Path(os.ttyname(far))


def _missing() -> ToolMissing:
    return ToolMissing(
        "Virtual robots and emulated boards need pseudo-terminals, and Windows has none.",
        "Use Linux (WSL or a virtual machine will do). Simulated robots and robots of your own do not need them.",
    )

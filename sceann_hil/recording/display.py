"""Whether a window can be opened here. Nothing here imports rerun."""

from __future__ import annotations

import os
import sys

from sceann_hil.errors import ViewerUnavailable

NO_DISPLAY = "Use --web for a browser, or run the command on a machine with a screen."


def require_display() -> None:
    """Refuse where no window can be opened.

    Raises:
        ViewerUnavailable: there is no display.
    """
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        raise ViewerUnavailable("There is no display to open a window on.", NO_DISPLAY)

"""The panel's link in a terminal, and as a QR code for a phone."""

from __future__ import annotations

import io
import shutil
from collections.abc import Callable

import segno

from sceann_hil.supervision.operators.web.panel import WebPanel

QUIET_ZONE = 2
"""Light modules around the code. The standard asks for 4; phones read 2, and 24 lines hold no more."""
LINES_FOR_THE_QUESTION = 6


def announce(panel: WebPanel, show: Callable[[str], object], lines: int | None = None) -> None:
    """Print the panel's link, and a QR code of it if it is for other devices.

    Args:
        panel: whose link.
        show: prints a line.
        lines: height of the terminal; None for that of this one. A code that would scroll away is not drawn.
    """
    show(f"Operator panel: {panel.url}")
    if panel.is_local:
        return
    code = qr_code(panel.url)
    height = lines if lines is not None else shutil.get_terminal_size().lines
    if code.count("\n") + 1 + LINES_FOR_THE_QUESTION > height:
        show("(The terminal is too low for the link's QR code: make it higher and press ?)")
    else:
        show(code)


def qr_code(text: str) -> str:
    """A QR code in half blocks, as few lines as can be read safely: no line break at the end."""
    drawn = io.StringIO()
    segno.make(text, error="l", boost_error=False).terminal(out=drawn, border=QUIET_ZONE, compact=True)
    return drawn.getvalue().rstrip("\n")

"""The panel's link in a terminal, and as a QR code for a phone."""

from __future__ import annotations

import io
import shutil
import sys

import segno

from sceann_hil.supervision.operators.web.panel import WebPanel

QUIET_ZONE = 2
"""Light modules around the code. The standard asks for 4; phones read 2, and 24 lines hold no more."""
LINES_FOR_THE_QUESTION = 6


def described(panel: WebPanel, lines: int | None = None) -> str:
    """The panel's link, and a QR code of it if it is for other devices and this terminal can show it.

    Args:
        panel: whose link.
        lines: height of the terminal; None for that of this one. A code that would scroll away is not drawn.
    """
    link = f"Operator panel: {panel.url}"
    if panel.is_local:
        return link
    code = qr_code(panel.url)
    height = lines if lines is not None else shutil.get_terminal_size().lines
    if not _can_be_shown(code):
        return link
    if code.count("\n") + 1 + LINES_FOR_THE_QUESTION > height:
        return f"{link}\n(No room for its QR code: make the terminal higher and press ?)"
    return f"{link}\n{code}"


def _can_be_shown(text: str) -> bool:
    try:
        text.encode(getattr(sys.stderr, "encoding", None) or "utf-8")
    except UnicodeEncodeError:
        return False
    return True


def qr_code(text: str) -> str:
    """A QR code in half blocks, as few lines as can be read safely: no line break at the end."""
    drawn = io.StringIO()
    segno.make(text, error="l", boost_error=False).terminal(out=drawn, border=QUIET_ZONE, compact=True)
    return drawn.getvalue().rstrip("\n")

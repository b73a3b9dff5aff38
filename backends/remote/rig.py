"""A machine that puts the robot where a trial starts, so that nobody has to stand beside it.

It listens on a TCP port. The host sends one line, ``{"place": {"x_m": 0.1, "y_m": 0.1, "heading_rad": 0.0}}``, and
waits for the line ``ok``; any other line says what went wrong.

A rig that watches the robot may also know why its bumper was hit (``bumper: rig``): to the line ``{"ended": true}`` it
answers ``goal``, ``fell`` or ``out_of_bounds``.
"""

from __future__ import annotations

import json
import socket
from typing import Any

from sceann_hil.robot import EndReason, LinkError

ASK_END = {"ended": True}
"""The question why the bumper is pressed."""
_ENDS = {end.name.lower(): end for end in (EndReason.GOAL, EndReason.FELL, EndReason.OUT_OF_BOUNDS)}
_ANSWER_S = 5.0
PLACING_S = 120.0
"""Longest time that placing a robot may take."""


def place(address: str, start: dict[str, float]) -> None:
    """Have the rig at ``host:port`` put the robot at a start.

    Raises:
        LinkError: the rig is not there, or says that it cannot.
    """
    answer = _asked(address, {"place": start}, PLACING_S)
    if answer != "ok":
        raise LinkError(f"reset rig at {address}: expected ok, got {answer!r}")


def why_ended(address: str) -> EndReason:
    """Have the rig at ``host:port`` say why the robot's bumper is pressed.

    Raises:
        LinkError: the rig is not there, or does not know.
    """
    answer = _asked(address, ASK_END, _ANSWER_S)
    if answer not in _ENDS:
        raise LinkError(f"reset rig at {address}: expected {', '.join(_ENDS)}, got {answer!r}")
    return _ENDS[answer]


def _asked(address: str, question: dict[str, Any], timeout_s: float) -> str:
    host, _, port = address.rpartition(":")
    try:
        with socket.create_connection((host, int(port)), timeout=timeout_s) as line, line.makefile("rw") as text:
            text.write(json.dumps(question) + "\n")
            text.flush()
            return text.readline().strip()
    except (OSError, ValueError) as error:
        raise LinkError(f"reset rig at {address}: {error}") from error

"""A machine that puts the robot where a trial starts, so that nobody has to stand beside it.

It listens on a TCP port. The host sends one line, ``{"place": {"x_m": 0.1, "y_m": 0.1, "heading_rad": 0.0}}``, and
waits for the line ``ok``; any other line says what went wrong.
"""

from __future__ import annotations

import json
import socket

from sceann_hil.robot import LinkError

PLACING_S = 120.0
"""Longest time that placing a robot may take."""


def place(address: str, start: dict[str, float]) -> None:
    """Have the rig at ``host:port`` put the robot at a start.

    Raises:
        LinkError: the rig is not there, or says that it cannot.
    """
    host, _, port = address.rpartition(":")
    try:
        with socket.create_connection((host, int(port)), timeout=PLACING_S) as line, line.makefile("rw") as text:
            text.write(json.dumps({"place": start}) + "\n")
            text.flush()
            answer = text.readline().strip()
    except (OSError, ValueError) as error:
        raise LinkError(f"reset rig at {address}: {error}") from error
    if answer != "ok":
        raise LinkError(f"reset rig at {address}: expected ok, got {answer!r}")

"""The serial ports of this computer, and what is wrong when one cannot be used."""

from __future__ import annotations

import errno
from pathlib import Path

import can
from serial.tools import list_ports
from serial.tools.list_ports_common import ListPortInfo

from sceann_hil.errors import FlashFailed


class PortProblem(can.CanInitializationError):
    """A port cannot be opened.

    Attributes:
        message: what is wrong.
        hint: what to do about it.
    """

    def __init__(self, message: str, hint: str) -> None:
        super().__init__(f"{message} {hint}")
        self.message = message
        self.hint = hint


def port_problem(port: str, error: Exception) -> PortProblem:
    """What an error from opening a port means."""
    number = getattr(error, "errno", None)
    text = str(error)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return PortProblem(f"{port}: there is no such port.", f"Ports now: {describe_ports()}")
    if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in text:
        return PortProblem(
            f"{port}: another program has this port open ({text}).", "Close it (a serial monitor?), then try again."
        )
    if number in (errno.EACCES, errno.EPERM):
        return PortProblem(
            f"{port}: you may not open this port.", "Add yourself to its group: usermod -aG dialout USER"
        )
    if number == errno.ENOTTY or "configure port" in text:
        return PortProblem(f"{port}: this is no serial port.", f"Ports now: {describe_ports()}")
    return PortProblem(f"{port}: the port cannot be opened: {text}.", f"Ports now: {describe_ports()}")


def serial_ports(include_links: bool = False) -> list[ListPortInfo]:
    """The ports that something is plugged into; a computer's built-in ones (ttyS0) have nothing behind them as a rule.

    Args:
        include_links: also the names that stay the same when other devices are plugged in.
    """
    found = list_ports.comports(include_links=include_links)
    return [port for port in found if port.vid is not None or not _built_in(port.device)]


def _built_in(device: str) -> bool:
    return Path(device).name.startswith("ttyS")


def describe_ports() -> str:
    """The serial ports of this computer as one line of text."""
    ports = [f"{port.device} ({port.description})" for port in serial_ports()]
    return ", ".join(ports) if ports else "none; is the board plugged in?"


def the_only_port() -> str:
    """The port to use when the user names none.

    Raises:
        FlashFailed: there is none, or more than one.
    """
    ports = serial_ports()
    if len(ports) != 1:
        wanted = "Name one with --port." if ports else "Plug the board in, or name its port with --port."
        raise FlashFailed(f"--port: which one? Ports now: {describe_ports()}.", wanted)
    return str(ports[0].device)

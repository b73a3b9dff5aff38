"""A CAN adapter through python-can, whose interfaces fail each in its own way."""

from __future__ import annotations

from typing import Any

import can


class AdapterProblem(can.CanInitializationError):
    """A CAN bus cannot be opened; the message holds the driver's own words."""


def known_interfaces() -> list[str]:
    """The interfaces that this installation of python-can knows."""
    return sorted(can.VALID_INTERFACES)


def open_can(interface: str, channel: str, bitrate: int | None = None, **options: Any) -> can.BusABC:
    """A bus.

    Raises:
        AdapterProblem: it cannot be opened, for whatever reason: adapter, driver, kernel, package, channel, option, or
            one of python-can's own configuration files.
    """
    given: dict[str, Any] = {} if bitrate is None else {"bitrate": bitrate}
    try:
        return can.Bus(interface=interface, channel=channel, **given, **options)
    except Exception as error:  # every driver has its own: OSError, ImportError, AttributeError, TypeError, ...
        words = str(error) or type(error).__name__
        raise AdapterProblem(f"CAN {interface}:{channel}: {words}") from error

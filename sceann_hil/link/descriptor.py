"""What a robot says that it is, and whether this host can work with it."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntFlag
from typing import Self

from sceann_hil.link.numbers import LINK_VERSION
from sceann_hil.network.controller import ARITHMETIC_ID
from sceann_hil.robot import LinkError

PAGES = 7
UNIQUE_ID_PAGE = 3


class Capability(IntFlag):
    """What a board can do."""

    BODY = 0x01
    """Own sensors and motors: modes onboard and tethered."""
    HIL = 0x02
    STORE = 0x04
    """Genome and last trial survive power loss."""
    AUTORUN = 0x08
    """May run a stored genome without a host."""
    WATCHDOG = 0x10
    BATTERY = 0x20
    BUMPER = 0x40
    BUTTON = 0x80
    """A start button."""


@dataclass(frozen=True, slots=True)
class Descriptor:
    """All pages of DESCRIPTOR.

    Attributes:
        name: at most 21 characters.
        unique_id: 56 bits that tell this board from all others.
        firmware: major, minor, patch.
        link_version: of the messages.
        arithmetic_id: of the neuron (CRC-32 of its table).
        n_sensors: of the body; 0 without one.
        n_motors: of the body; 0 without one.
        max_sensors: of the largest network.
        max_motors: of the largest network.
        max_sources: of the largest network.
        tick_min_s: shortest control period.
        tick_max_s: longest control period.
        capabilities: what the board can do.
        node: the number that it answers to.
    """

    name: str
    unique_id: int
    firmware: tuple[int, int, int]
    link_version: int
    arithmetic_id: int
    n_sensors: int
    n_motors: int
    max_sensors: int
    max_motors: int
    max_sources: int
    tick_min_s: float
    tick_max_s: float
    capabilities: Capability
    node: int = 1

    @classmethod
    def from_pages(cls, pages: dict[int, bytes]) -> Self:
        """From the seven bytes of each page 0..6.

        Raises:
            KeyError: a page is missing.
        """
        link_version, n_sensors, n_motors, arithmetic_id = struct.unpack("<BBBI", pages[0])
        major, minor, patch, capabilities, node, _ = struct.unpack("<BBBHBB", pages[1])
        max_sensors, max_motors, max_sources, tick_min, tick_max = struct.unpack("<BBBHH", pages[2])
        name = b"".join(pages[page] for page in (4, 5, 6))
        return cls(
            name=name.rstrip(b"\0").decode("ascii", "replace"),
            unique_id=int.from_bytes(pages[3], "little"),
            firmware=(major, minor, patch),
            link_version=link_version,
            arithmetic_id=arithmetic_id,
            n_sensors=n_sensors,
            n_motors=n_motors,
            max_sensors=max_sensors,
            max_motors=max_motors,
            max_sources=max_sources,
            tick_min_s=tick_min * 1e-4,
            tick_max_s=tick_max * 1e-4,
            capabilities=Capability(capabilities),
            node=node,
        )

    def check_versions(self) -> None:
        """Refuse a robot that speaks or computes differently.

        Raises:
            LinkError: which number differs.
        """
        if self.link_version != LINK_VERSION:
            raise LinkError(
                f"{self.name}: expected link version {LINK_VERSION}, the robot has {self.link_version}; "
                "flash firmware of this release"
            )
        if self.arithmetic_id != ARITHMETIC_ID:
            raise LinkError(
                f"{self.name}: expected arithmetic {ARITHMETIC_ID:08x}, the robot has {self.arithmetic_id:08x}; "
                "its neurons would compute something else: flash firmware of this release"
            )

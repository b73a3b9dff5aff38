"""Robots of the posix board for the tests of `backends.remote`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from backends.cartpole import CartPole
from backends.virtual.body import VirtualBody
from backends.virtual.cable import Cable
from backends.virtual.virtual_posix import VirtualPosix
from sceann_hil.firmware.emulated.posix import PosixBoard


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """A robot that is starved of processor time rightly voids its trials: these tests want the machine."""
    here = Path(__file__).parent
    for item in items:
        if here in item.path.parents:
            item.add_marker(pytest.mark.realtime)


@pytest.fixture
def board() -> Iterator[PosixBoard]:
    """A board without a body, for mode hil."""
    with PosixBoard(terminal=True) as board:
        yield board


@pytest.fixture
def virtual() -> Iterator[VirtualPosix]:
    """A cart with a pole."""
    with VirtualPosix(VirtualBody(CartPole())) as virtual:
        yield virtual


@pytest.fixture
def bad_board(tmp_path: Path) -> Iterator[tuple[PosixBoard, Cable]]:
    """A board without a body whose store survives, at the end of a bad cable."""
    with PosixBoard(store=tmp_path / "eeprom") as board:
        assert board.line is not None
        line = Cable(board.line.socket, tmp_path / "port")
        yield board, line
        line.close()


@pytest.fixture
def bad_robot(tmp_path: Path) -> Iterator[tuple[VirtualPosix, Cable]]:
    """A cart with a pole at the end of a bad cable."""
    with VirtualPosix(VirtualBody(CartPole()), store=tmp_path / "eeprom", terminal=False) as virtual:
        assert virtual.board.line is not None
        line = Cable(virtual.board.line.socket, tmp_path / "port")
        yield virtual, line
        line.close()

"""All our robots do what every robot must do."""

from __future__ import annotations

import os
import pty
import threading
import tty
from collections.abc import Iterator

import pytest

from backends.cartpole import CartPole, CartPoleConfig
from backends.diffdrive import DifferentialDriveConfig
from backends.remote import RemoteConfig
from backends.virtual.body import VirtualBody
from backends.virtual.virtual_posix import VirtualPosix
from examples.light_seeker import LightSeekerConfig
from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.plugins import RobotConfig
from sceann_hil.testing import RobotConformance
from tests.backends.remote.trials import virtual_config


class TestCartPole(RobotConformance):
    def config(self) -> RobotConfig:
        return CartPoleConfig()

    def start(self) -> tuple[float, ...]:
        return (0.0, 0.0, 0.0175, 0.0)


class TestDifferentialDrive(RobotConformance):
    def config(self) -> RobotConfig:
        return DifferentialDriveConfig(n_sensors=3)

    def start(self) -> tuple[float, ...]:
        return (0.1, 0.1, 0.5)


class TestInTheLoop(RobotConformance):
    @pytest.fixture(autouse=True)
    def _board(self) -> Iterator[None]:
        with PosixBoard(terminal=True) as self.board:
            yield

    def config(self) -> RobotConfig:
        return RemoteConfig(port=str(self.board.port), mode="hil", body=CartPoleConfig())


class TestOnboard(RobotConformance):
    mode = "onboard"
    max_steps = 8
    n_trials = 2

    @pytest.fixture(autouse=True)
    def _robot(self) -> Iterator[None]:
        with VirtualPosix(VirtualBody(CartPole())) as self.virtual:
            yield

    def config(self) -> RobotConfig:
        return virtual_config(self.virtual, self.mode)


class TestTethered(TestOnboard):
    mode = "tethered"


class Rover:
    """What the example robot talks to: answers questions on a pseudo-terminal, and remembers the wheels."""

    def __init__(self) -> None:
        self.wheels: list[str] = []
        near, far = pty.openpty()
        tty.setraw(far)
        self.port = os.ttyname(far)
        self._descriptors = (near, far)
        self._thread = threading.Thread(target=self._answer, daemon=True)
        self._thread.start()

    def _answer(self) -> None:
        with open(self._descriptors[0], "r+b", buffering=0, closefd=False) as line:
            question = b""
            while (byte := line.read(1)) != b"\x04":
                question += byte
                if byte == b"\n":
                    line.write(b"300 512 700\n" if question == b"s\n" else b"ok\n")
                    if question.startswith(b"m"):
                        self.wheels.append(question.decode().strip())
                    question = b""

    def close(self) -> None:
        os.write(self._descriptors[1], b"\x04")
        self._thread.join()
        for descriptor in self._descriptors:
            os.close(descriptor)


class TestLightSeeker(RobotConformance):
    max_steps = 8
    n_trials = 2

    @pytest.fixture(autouse=True)
    def _rover(self) -> Iterator[None]:
        self.rover = Rover()
        yield
        assert not self.rover.wheels or self.rover.wheels[-1] == "m 0 0"
        self.rover.close()

    def config(self) -> RobotConfig:
        return LightSeekerConfig(port=self.rover.port)

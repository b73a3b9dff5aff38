"""Every board against the reference over its own link, with the firmware that would be flashed."""

from __future__ import annotations

import time

import numpy as np
import pytest

from sceann_hil.firmware.build import Board
from sceann_hil.firmware.emulated.lines import emulated_line
from sceann_hil.firmware.emulated.simavr import UnoBoard
from sceann_hil.firmware.verify import random_sequences, verify
from sceann_hil.link.framed_bus import Line, LineBus
from sceann_hil.link.hil import run_hil_trial
from sceann_hil.link.messages import LinkEnd
from sceann_hil.link.numbers import HOST_DEADLINE_S
from sceann_hil.link.session import RobotLink
from sceann_hil.link.trial import Order
from sceann_hil.link.upload import upload_image
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics, Neuron
from sceann_hil.network.image import ControllerImage

IMAGE = ControllerImage(
    np.random.default_rng(8).integers(0, 2, Coding.SCEANN1.genome_length(NetworkSize(7, 4, 2))).astype(np.uint8),
    Coding.SCEANN1,
    NetworkSize(7, 4, 2),
)


@pytest.mark.parametrize("board", Board)
def test_every_state_is_equal_on_every_board(board: Board) -> None:
    # an emulator in JavaScript is a hundred times slower
    n_sequences, n_steps = (6, 8) if board is Board.PICO else (25, 24)
    sequences = random_sequences(np.random.default_rng(3), n_sequences, n_steps, 7)
    with emulated_line(board) as line:
        link = RobotLink(LineBus(line))
        result = verify(link, IMAGE, sequences)
        link.close()
    assert result.equal, result.difference
    steps = n_sequences * n_steps
    assert (result.sequences, result.steps, result.states) == (n_sequences, steps, 6 * steps)


def test_a_board_that_computes_something_else_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    other = ControllerImage(IMAGE.genome, IMAGE.coding, IMAGE.size, Dynamics(Neuron.MEMORYLESS))
    monkeypatch.setattr(ControllerImage, "controller", lambda _: _reference_of(other))
    with emulated_line(Board.POSIX) as line:
        link = RobotLink(LineBus(line))
        result = verify(link, IMAGE, random_sequences(np.random.default_rng(3), 5, 50, 7))
        link.close()
    assert not result.equal
    assert result.difference is not None
    assert result.difference.step >= 1


class LossyLine:
    """An emulated board's line that loses every hundredth frame to the host, STATES among them."""

    def __init__(self, line: Line) -> None:
        self._line, self._sent = line, 0

    def write(self, data: bytes) -> None:
        self._line.write(data)

    def read(self, timeout_s: float) -> bytes:
        kept = b""
        for frame in self._line.read(timeout_s).split(b"\0")[:-1]:
            self._sent += 1
            kept += b"" if self._sent % 100 == 0 else frame + b"\0"
        return kept


def test_a_line_that_loses_frames_is_no_wrong_board() -> None:
    """A sequence with a hole is run again: only a state that came and differs is a difference."""
    with emulated_line(Board.POSIX) as line:
        link = RobotLink(LineBus(LossyLine(line)))
        result = verify(link, IMAGE, random_sequences(np.random.default_rng(3), 10, 12, 7))
        link.close()
    assert result.equal, result.difference


def test_an_emulated_unos_time_stands_still_while_its_host_is_late() -> None:
    """Nothing that a busy computer does to the host reaches the chip: no deadline passes while nobody reads."""
    with UnoBoard(("-DBAUD=500000UL",)) as board:
        link = RobotLink(LineBus(board))
        upload_image_after_hello(link)
        order = Order(1, 40, 0.02, 7, 2)
        body = Slow()
        follower, _ = run_hil_trial(link, order, body)
        link.close()
    assert follower.end is not None
    assert follower.end.reason is LinkEnd.MAX_TICKS
    assert body.slept_s > HOST_DEADLINE_S


def upload_image_after_hello(link: RobotLink) -> None:
    link.hello()
    upload_image(link, IMAGE)


class Slow:
    """A body that takes longer than the robot waits for a heartbeat."""

    def __init__(self) -> None:
        self.state, self.slept_s = np.zeros(0, np.float32), 0.0

    def sense(self) -> np.ndarray:
        if self.slept_s <= HOST_DEADLINE_S:
            time.sleep(2 * HOST_DEADLINE_S)
            self.slept_s += 2 * HOST_DEADLINE_S
        return np.full(7, 500, np.uint16)

    def move(self, motors: tuple[int, ...]) -> None:
        return None


def _reference_of(image: ControllerImage):
    from sceann_hil.network.controller import Controller

    return Controller(image.weights, image.size, image.dynamics)


def test_sequences_reach_every_extreme() -> None:
    values = np.concatenate([s.ravel() for s in random_sequences(np.random.default_rng(0), 30, 50, 3)])
    assert {0, 511, 512, 1023} <= set(values.tolist())
    assert values.max() <= 1023

"""Every board against the reference over its own link, with the firmware that would be flashed."""

from __future__ import annotations

import numpy as np
import pytest

from sceann_hil.firmware.build import Board
from sceann_hil.firmware.emulated.lines import emulated_line
from sceann_hil.firmware.verify import random_sequences, verify
from sceann_hil.link.client import RobotClient
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
    sequences = random_sequences(np.random.default_rng(3), 25, 24, 7)
    with emulated_line(board) as line:
        result = verify(RobotClient(line), IMAGE, sequences)
    assert result.equal, result.difference
    assert (result.sequences, result.steps, result.states) == (25, 600, 3600)


def test_a_board_that_computes_something_else_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    other = ControllerImage(IMAGE.genome, IMAGE.coding, IMAGE.size, Dynamics(Neuron.MEMORYLESS))
    monkeypatch.setattr(ControllerImage, "controller", lambda _: _reference_of(other))
    with emulated_line(Board.POSIX) as line:
        result = verify(RobotClient(line), IMAGE, random_sequences(np.random.default_rng(3), 5, 50, 7))
    assert not result.equal
    assert result.difference is not None
    assert result.difference.step >= 1


def _reference_of(image: ControllerImage):
    from sceann_hil.network.controller import Controller

    return Controller(image.weights, image.size, image.dynamics)


def test_sequences_reach_every_extreme() -> None:
    values = np.concatenate([s.ravel() for s in random_sequences(np.random.default_rng(0), 30, 50, 3)])
    assert {0, 511, 512, 1023} <= set(values.tolist())
    assert values.max() <= 1023

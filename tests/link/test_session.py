"""Handshake, requests and heartbeats against the firmware itself (posix board on a pseudo-terminal)."""

from __future__ import annotations

import time
from collections.abc import Iterator

import can
import numpy as np
import pytest

from sceann_hil.firmware.emulated.posix import PosixBoard
from sceann_hil.link import session as session_module
from sceann_hil.link.line import LinkDown
from sceann_hil.link.messages import LinkEnd, start_arguments
from sceann_hil.link.serial_bus import SceannSerialBus
from sceann_hil.link.session import NoAnswer, Refused, RobotLink
from sceann_hil.link.upload import shortest_genome, upload
from sceann_hil.link.vocabulary import Mode, Op, State, Status, Telemetry
from sceann_hil.network.coding import Coding, NetworkSize
from sceann_hil.network.controller import Dynamics
from sceann_hil.robot import LinkError


@pytest.fixture
def board() -> Iterator[PosixBoard]:
    with PosixBoard(terminal=True, name="link test", unique_id=77) as board:
        yield board


def link_to(board: PosixBoard, node: int = 1) -> RobotLink:
    return RobotLink(SceannSerialBus(str(board.port)), node)


def test_the_handshake_reads_what_the_robot_is(board: PosixBoard) -> None:
    link = link_to(board)
    descriptor = link.hello()
    link.close()
    assert (descriptor.name, descriptor.unique_id) == ("link test", 77)


def test_nobody_on_this_node_is_one_clear_error(board: PosixBoard) -> None:
    link = link_to(board, node=2)
    with pytest.raises(NoAnswer, match="node 2"):
        link.hello(patience_s=0.1)
    link.close()


@pytest.mark.parametrize(("name", "value"), [("LINK_VERSION", 99), ("ARITHMETIC_ID", 1)])
def test_other_versions_are_refused(board: PosixBoard, monkeypatch: pytest.MonkeyPatch, name: str, value: int) -> None:
    from sceann_hil.link import messages

    monkeypatch.setattr(session_module, name, value)
    monkeypatch.setattr(messages, name, value, raising=False)
    link = link_to(board)
    with pytest.raises(LinkError, match="flash"):
        link.hello()
    link.close()


def test_the_heartbeat_thread_keeps_a_second_host_out_and_silence_lets_it_in(board: PosixBoard) -> None:
    first = link_to(board)
    first.hello()
    second = RobotLink(first._bus, session=first.session % 65535 + 1)
    with first.exclusive(), pytest.raises(LinkError, match="another host"):
        second.hello(patience_s=0.0)
    first._closing.set()
    assert second.hello().name == "link test"
    second.close()


def test_a_restarted_robot_is_noticed(board: PosixBoard) -> None:
    link = link_to(board)
    link.hello()
    board.power_off()
    board.power_on()
    with pytest.raises(Refused) as refused:
        link.request(Op.ARM)
    assert refused.value.status is Status.NO_SESSION
    assert link.boots >= 1
    link.close()


def test_a_closed_port_is_a_link_that_is_down(board: PosixBoard) -> None:
    link = link_to(board)
    link.hello()
    link._closing.set()
    link._bus.shutdown()
    with pytest.raises(LinkDown):
        link.request(Op.LAST)
    link.close()


def test_a_port_that_does_not_exist() -> None:
    with pytest.raises(can.CanInitializationError, match="no_such_port"):
        SceannSerialBus("/dev/no_such_port")


def test_a_stuck_host_stops_the_robot(board: PosixBoard) -> None:
    """Only `receive` sends heartbeats while somebody holds the link: a loop that hangs is a host that is dead."""
    size = NetworkSize(2, 1, 1)
    link = link_to(board)
    link.hello()
    upload(link, np.ones((2, 4), np.int8), size, Dynamics())
    with link.exclusive(trial_id=5):
        link.request(Op.ARM)
        link.request(Op.START, start_arguments(5, 100, Mode.HIL, Telemetry.NONE))
        assert link.receive(0.15) is not None
        assert link.state is State.RUNNING
        time.sleep(0.5)
        while link.receive(0.05):
            pass
    assert link.state is State.SAFE
    assert link.last().reason is LinkEnd.LINK_LOST
    link.close()


def test_every_matrix_has_a_shortest_genome_that_expresses_it() -> None:
    rng = np.random.default_rng(1)
    size = NetworkSize(3, 2, 2)
    for coding in Coding:
        for _ in range(50):
            bits = rng.integers(0, 2, coding.genome_length(size), np.uint8)
            weights = coding.decode(bits, size)
            shortest, genome = shortest_genome(weights, size)
            assert np.array_equal(shortest.decode(genome, size), weights)
            assert len(genome) <= coding.genome_length(size)


def test_uploads_of_all_sizes_commit(board: PosixBoard) -> None:
    rng = np.random.default_rng(2)
    link = link_to(board)
    link.hello()
    for size in (NetworkSize(1, 0, 1), NetworkSize(2, 3, 1), NetworkSize(12, 8, 3)):
        weights = rng.integers(-1, 2, (size.n_neurons, size.n_sources)).astype(np.int8)
        upload(link, weights, size, Dynamics())
    assert link.statistics.retries == 0
    link.close()
